/* The accumulation buffer of a render: per pixel the moments, the sums of the adaptive rule and of
 * the error estimate, and averages over the first hits (AOVs). A render can be stopped and resumed
 * from it. */
#ifndef ASSAY_FILM_H
#define ASSAY_FILM_H

#include "integrator.h"
#include "renderer/image/moments.h"

/* Sums over the samples of one pixel. */
struct first_hit_sums {
    double hits;      /* samples whose camera ray met something */
    double depth;     /* over those */
    double normal[3]; /* over all samples, as albedo; a miss adds nothing */
    double albedo[3];
    double object; /* 1 + object number of the pixel's first sample, 0 where it missed */
};

struct film {
    struct moments m;
    /* Illuminance, the assignment's word for luminance: sums of it and of its square. */
    double *s1, *s2;
    struct first_hit_sums *first; /* NULL: not kept */
    /* How many samples each pixel gets, counted from sample number 0, as a pilot decided; NULL: there
     * was no pilot. */
    uint32_t *target;
    /* Every pixel has seen this many sample numbers: it took them all, or had stopped before. */
    uint32_t num_samples;
};

/* Allocates a film, all zero and without target. False if out of memory. film_free() it. */
NODISCARD bool film_alloc(struct film *f, int width, int height, bool first_hits, struct err *e);
void film_free(struct film *f);

/* Sets the unit of the moments: "sample" for the independent sampler, else "stratified". */
void film_set_sampler(struct film *f, enum sampler_kind kind);
/* Adds the first hit of lane i to a pixel of a film with first hits, after its radiance was added (film_simd.h). */
void film_add_first_hit(struct film *f, size_t pixel, const struct first_hits *h, int i);

/* Adds the samples of pixels first .. first+num-1 of src after those that dst has, by
 * moments_merge(). Both films must have the same size and the same layers; targets and num_samples
 * are ignored. */
NODISCARD bool film_merge(struct film *dst, const struct film *src, size_t first, int num,
                          struct err *e);

/* Root mean square over the pixels of the standard error of luminance, over the mean luminance of the
 * image. INFINITY while a pixel has fewer than two samples or the image is black. */
double film_relative_error(const struct film *f);

/* The layers beside the moments, as an image to write with them: variance.R G B (of one sample),
 * stderr.R G B (of the pixel), depth.Z, depth.hits, normal.X Y Z, albedo.R G B, id.object.
 * Variance and stderr are INFINITY below two samples. depth.Z is the distance from the plane through
 * the eye, along the viewing axis, in scene units, averaged over depth.hits samples, and 1e10 where
 * there are none, as in Blender. Normals are in world space; their means are not of unit length. */
NODISCARD bool film_layers(const struct film *f, struct image *out, struct err *e);

enum { NUM_LAYERS = 15 };
extern const char *const layer_names[NUM_LAYERS];
/* Fills variance and stderr, the first six of a pixel's layers. */
void layers_of_moments(const struct moments *m, size_t pixel, float layers[6]);

#endif
