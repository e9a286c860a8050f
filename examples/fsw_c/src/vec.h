/* Three-vectors and rotations, as small functions on arrays of three. */
#ifndef VEC_H
#define VEC_H

#include <math.h>

static inline double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline double norm(const double a[3]) { return sqrt(dot(a, a)); }

static inline void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* out = a + k b */
static inline void add_scaled(const double a[3], double k, const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[i] + k * b[i];
}

static inline void subtract(const double a[3], const double b[3], double out[3]) { add_scaled(a, -1.0, b, out); }

/* out = M v */
static inline void rotate(double m[3][3], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = dot(m[i], v);
}

/* out = transpose(M) v */
static inline void rotate_back(double m[3][3], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = m[0][i] * v[0] + m[1][i] * v[1] + m[2][i] * v[2];
}

/* Angle between two vectors [rad]; by atan2, which keeps its precision near 0 and pi. */
static inline double angle_between(const double a[3], const double b[3])
{
    double normal[3];
    cross(a, b, normal);
    return atan2(norm(normal), dot(a, b));
}

#endif
