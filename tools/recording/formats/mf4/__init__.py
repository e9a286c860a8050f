"""ASAM MDF 4 (.mf4) with bus logging: channels CAN_DataFrame, CAN_ErrorFrame, CAN_RemoteFrame.

Source: ASAM MDF 4.2, "Measurement Data Format", and its associated standard on bus logging, as far as they
are known from programs that follow them: asammdf, mdflib, mdf4-converters of CSS Electronics.
"""
