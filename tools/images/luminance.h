/* Luminance of linear RGB by Rec. 709. */
#ifndef ASSAY_LUMINANCE_H
#define ASSAY_LUMINANCE_H

static const double luminance_weight[3] = {0.2126, 0.7152, 0.0722};

static inline double luminance(const double v[3])
{
    return luminance_weight[0] * v[0] + luminance_weight[1] * v[1] + luminance_weight[2] * v[2];
}

#endif
