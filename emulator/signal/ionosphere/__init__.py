"""The ionosphere for a craft inside it.

klobuchar  vertical content by the eight coefficients that GPS broadcasts
maps       vertical content from measured maps (IONEX)
profile    how the vertical content is spread over height
field      the two together, prepared for a run; low and high solar activity
slant      content along a ray, by quadrature
delay      what the content does to code, carrier and range rate
"""
