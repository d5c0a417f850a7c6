/* The colours of FLIP [Andersson20, 4.1]: linear BT.709 RGB, its opponent axes, Hunt-adjusted L*a*b*, and how far
 * apart two colours are. */
#ifndef ASSAY_FLIP_COLOUR_H
#define ASSAY_FLIP_COLOUR_H

struct flip_colours {
    float to[3][3], from[3][3]; /* RGB to X/Xn, Y/Yn, Z/Zn, white being RGB 1, 1, 1; and back */
    float largest; /* HyAB distance to the power 0.7 of green and blue, the largest of all */
};
struct flip_colours flip_colours(void);

void flip_multiply(const float m[3][3], const float v[3], float out[3]);
/* CIE L*a*b* of RGB with less chroma in the dark: L*, 0.01 L* a*, 0.01 L* b*. */
void flip_lab(const struct flip_colours *c, const float rgb[3], float lab[3]);
/* The error in [0, 1] of two such colours: their HyAB distance to the power 0.7, redistributed so that 0.4
 * of the largest becomes 0.95. */
float flip_colour_error(const struct flip_colours *c, const float a[3], const float b[3]);

#endif
