#include "score.h"

#include <math.h>

double score_share(const struct margin *m, const struct interval *i)
{
    return fmin(1, fmax(0, (m->none - interval_distance(i)) / (m->none - m->full)));
}

double score_width(const struct margin *m, const struct interval *i)
{
    return fmin(1, fmax(0, 2 - interval_half(i) / m->none));
}

double score_more(const struct margin *m, const struct interval *i, double blur)
{
    double wide = (interval_half(i) - blur) / m->none;
    return wide > 1 && score_share(m, i) > 0 ? wide * wide : 0;
}

static double beyond(double distance, double sd)
{
    return sd > 0 ? 0.5 * erfc(distance / (sd * sqrt(2))) : distance >= 0 ? 0 : 1;
}

double score_chance(const struct margin *m, const struct interval *i)
{
    double share = score_share(m, i), half = interval_half(i), v = fabs(i->value);
    if (share == 1)
        return fmin(1, beyond(m->full + half - v, i->sd) + beyond(m->full + half + v, i->sd));
    return share == 0 ? beyond(v - half - m->none, i->sd) : 1;
}

struct interval score_at_least(struct interval i)
{
    const double lo = fmin(0, i.lo);
    return (struct interval){fmin(0, i.value), lo, fmin(i.hi, -lo), i.sd};
}

double score_pixels(const struct margin *m, double wrong, double num)
{
    double v = num > 0 ? wrong / num : 1;
    const struct interval i = {v, v, v, 0};
    return score_share(m, &i);
}

double score_round(double share, double points)
{
    if (points <= 0 || share <= 0)
        return share;
    return fmax(0, 1 - round(100 * points * (1 - share)) / (100 * points));
}
