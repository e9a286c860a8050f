"""Studies: many runs of one scenario, compared.

pair       two craft side by side, played inline: what each fix is off, and the difference of the two
factors    one error factor at a time
page       the figures of a study as one HTML file
"""
