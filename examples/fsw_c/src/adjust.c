#include "adjust.h"

#include <math.h>
#include <string.h>

#define SMALLEST_PIVOT 1e-13 /* of the diagonal it came from */

void normal_clear(struct normal *normal, int unknowns)
{
    memset(normal, 0, sizeof *normal);
    normal->unknowns = unknowns;
}

void normal_add(struct normal *normal, const double row[MAX_UNKNOWNS], double residual, double weight)
{
    for (int i = 0; i < normal->unknowns; i++) {
        for (int j = 0; j <= i; j++)
            normal->matrix[i][j] += weight * row[i] * row[j];
        normal->right[i] += weight * row[i] * residual;
    }
}

bool normal_factor(struct normal *normal)
{
    double (*l)[MAX_UNKNOWNS] = normal->matrix;
    for (int i = 0; i < normal->unknowns; i++) {
        double diagonal = l[i][i];
        for (int j = 0; j <= i; j++) {
            double sum = l[i][j];
            for (int k = 0; k < j; k++)
                sum -= l[i][k] * l[j][k];
            if (j < i)
                l[i][j] = sum / l[j][j];
            else if (sum > SMALLEST_PIVOT * diagonal)
                l[i][i] = sqrt(sum);
            else
                return false; /* also where a sum is not a number */
        }
    }
    return true;
}

static void forward(const struct normal *normal, double x[MAX_UNKNOWNS])
{
    for (int i = 0; i < normal->unknowns; i++) {
        for (int k = 0; k < i; k++)
            x[i] -= normal->matrix[i][k] * x[k];
        x[i] /= normal->matrix[i][i];
    }
}

static void backward(const struct normal *normal, double x[MAX_UNKNOWNS])
{
    for (int i = normal->unknowns - 1; i >= 0; i--) {
        for (int k = i + 1; k < normal->unknowns; k++)
            x[i] -= normal->matrix[k][i] * x[k];
        x[i] /= normal->matrix[i][i];
    }
}

void normal_solve(const struct normal *normal, double x[MAX_UNKNOWNS])
{
    memcpy(x, normal->right, sizeof normal->right);
    forward(normal, x);
    backward(normal, x);
}

void normal_covariance(const struct normal *normal, double covariance[3][3])
{
    for (int column = 0; column < 3; column++) {
        double x[MAX_UNKNOWNS] = {0};
        x[column] = 1.0;
        forward(normal, x);
        backward(normal, x);
        for (int row = 0; row < 3; row++)
            covariance[row][column] = x[row];
    }
}
