"""Which satellite had which number when, and where its antenna's phase centre is: tables, nothing else.

Offsets belong to the ionosphere-free combination of L1 and L2, to which precise clocks refer; those of L1
alone differ by centimetres to decimetres that no source here has. Orbits, clocks and offsets of a product
belong together: where the model of the International GNSS Service changed, rows say from when.

Sources
numbers     launches and numbers by date, JPL's file PRN_GPS as kept in gnssrefl (2019); dates of 2004-06-23,
            2009-06-08 and satellites 75 to 77 as in igs05.atx and RTKLIB's list of catalogue numbers (2020);
            78 and 79 typed from memory
offsets     igs05.atx of week 1627 (R. Schmid et al., J. Geodesy 81, 2007): z of each satellite, x of blocks
            G062, G063: z of 1.5973 and 1.5613 m from igs08_1706.atx on (IGS mail of 2012-09-05); the others
            of their block are given the mean of the two (modelled)
            G062 before: 1.093 m until week 1602, then 1.407 m (comments of igs05.atx)
            GPS III: 1.93 m, estimated by ESOC for G074 (F. Dilssner, IGS mail of 2019-01-11), x taken as 0
            GLONASS-M: x -0.545 m, z 2.30 m in igs05.atx, 2.45 m in igs14.atx (IGS mails of 2018-08-07,
            2020-04-14), both block values; GLONASS: igs05.atx. GLONASS-K is taken for M, 0.4 m off (modelled)
"""

from __future__ import annotations

GPS_NUMBERS = """
    24 1991-07-04 24    25 1992-02-23 25    26 1992-07-07 26    27 1992-09-09 27    29 1992-12-18 29
    32 1993-01-28  1    37 1993-05-13  7    39 1993-06-26  9    35 1993-08-30  5    34 1993-10-26  4
    36 1994-03-10  6    33 1996-03-28  3    40 1996-07-16 10    30 1996-09-12 30    43 1997-07-23 13
    38 1997-11-06  8    46 1999-10-07 11    51 2000-05-11 20    44 2000-07-16 28    41 2000-11-10 14
    54 2001-01-30 18    56 2003-01-29 16    45 2003-03-31 21    47 2003-12-21 22    59 2004-03-20 19
    60 2004-06-23 23    61 2004-11-06  2    53 2005-09-26 17    52 2006-09-25 31    58 2006-11-17 12
    23 2006-11-30 32    55 2007-10-17 15    57 2007-12-20 29    48 2008-03-15  7    37 2008-10-22  1
    49 2009-03-24  1    50 2009-08-17  5    35 2010-02-09 25    62 2010-05-28 25    35 2011-06-02  1
    63 2011-07-16  1    35 2011-08-05 30    49 2012-02-01 24    32 2012-03-14 24    37 2012-04-26 24
    49 2012-08-08 24    65 2012-10-08 24    49 2012-10-18 27    66 2013-05-09 27    49 2013-05-09 30
    32 2013-08-23 30    37 2013-09-19 30    27 2013-12-03 30    49 2013-12-20 30    64 2014-02-25 30
    49 2014-04-03  6    67 2014-05-17  6    68 2014-08-02  9    35 2014-09-05  3    69 2014-10-29  3
    32 2015-02-05 26    27 2015-02-25 26    71 2015-03-25 26    49 2015-04-30  8    72 2015-07-15  8
    36 2015-09-16 10    73 2015-10-31 10    49 2016-02-01  4    70 2016-02-05 32    32 2016-09-15  4
    34 2016-12-09  4    49 2017-01-05  4    38 2017-05-18  4    36 2017-07-20  4    49 2017-12-01  4
    34 2018-03-05 18    36 2018-10-10  4    74 2019-01-02  4    75 2019-08-22 18    76 2020-06-30 23
    77 2020-11-05 14    78 2021-06-17 11    79 2023-01-18 28
"""
"""Space vehicle, first day, PRN; it lasts until the number's next row."""

GPS_OFFSETS = """
    iia   0.279   23 2.575   24 2.455   25 2.295   26 2.307   27 2.472   29 2.352   30 2.466   32 2.201
                  33 2.619   34 2.279   35 2.463   36 2.676   37 2.220   38 2.405   39 2.340   40 2.389
    iir   0.000   41 1.178   43 1.203   44 0.911   45 1.300   46 0.971   51 1.154   54 1.133   56 1.307
                  47 0.792   59 0.668   60 0.602   61 0.614
    iirm  0.000   48 0.700   49 0.700   50 0.700   52 0.750   53 0.645   55 0.700   57 0.700   58 0.700
    iif   0.394   62 1.597   63 1.561   64 1.579   65 1.579   66 1.579   67 1.579   68 1.579   69 1.579
                  70 1.579   71 1.579   72 1.579   73 1.579
    iii   0.000   74 1.930   75 1.930   76 1.930   77 1.930   78 1.930   79 1.930
"""
"""Block, its x [m], then space vehicles and their z [m]."""

G062_Z_M = (("2010-05-28", 1.093), ("2010-09-19", 1.407), ("2011-04-17", 1.597))
"""First day of each value."""

GLONASS_M_Z_M = (("1982-10-12", 2.30), ("2011-04-17", 2.45))
GLONASS_M_X_M = -0.545

GLONASS_FIRST = {1: ("2009-12-14", 1.944), 4: ("2009-12-14", 2.006)}
"""Slots that still held a satellite before the M type, of x 0: until when (exclusive), and its z [m]."""
