"""Do the measurements agree, and if not, which satellite is it?"""
