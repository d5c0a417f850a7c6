#include "discrete.h"

#include <assert.h>

double discrete_build(const double *weight, uint32_t n, uint32_t *end)
{
    assert(n >= 1 && n <= DISCRETE_MOST);
    double total = 0, sum = 0;
    uint32_t positive = 0, seen = 0;
    for (uint32_t i = 0; i < n; i++) {
        assert(weight[i] >= 0);
        total += weight[i];
        positive += weight[i] > 0;
    }
    /* One step for each positive weight, the rest in proportion. The last sum equals the total bit for bit. */
    for (uint32_t i = 0; i < n; i++) {
        sum += weight[i];
        seen += weight[i] > 0;
        end[i] = total > 0 ? seen + (uint32_t)(sum / total * (DISCRETE_STEPS - positive)) : 0;
    }
    return total;
}
