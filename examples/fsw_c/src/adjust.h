/* Least squares by normal equations and Cholesky, on arrays of fixed size. */
#ifndef ADJUST_H
#define ADJUST_H

#include <stdbool.h>

#include "contract.h"

enum { MAX_UNKNOWNS = 3 + CLOCK_ITEMS };

struct normal {
    int unknowns;
    double matrix[MAX_UNKNOWNS][MAX_UNKNOWNS]; /* lower triangle; after normal_factor its Cholesky factor */
    double right[MAX_UNKNOWNS];
};

void normal_clear(struct normal *normal, int unknowns);
void normal_add(struct normal *normal, const double row[MAX_UNKNOWNS], double residual, double weight);

/* Cholesky, in place; false where the unknowns cannot be told apart. */
bool normal_factor(struct normal *normal);

/* After normal_factor. */
void normal_solve(const struct normal *normal, double x[MAX_UNKNOWNS]);

/* After normal_factor: the upper left 3 x 3 of the inverse. */
void normal_covariance(const struct normal *normal, double covariance[3][3]);

#endif
