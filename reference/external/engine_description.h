/* Any renderer, described by a small JSON file that says how to call it and what it can express
 * (tools/docs/formats/engine.md). Commands run without a shell. */
#ifndef ASSAY_ENGINE_DESCRIPTION_H
#define ASSAY_ENGINE_DESCRIPTION_H

#include "renderer/image/moments.h"
#include "reference/suite/suite.h"

enum engine_output { OUTPUT_MEAN, OUTPUT_EXACT, OUTPUT_MOMENTS, OUTPUT_NOISY };

struct engine {
    char file[4096]; /* the description */
    char here[4096]; /* its directory, absolute */
    char name[32];
    const struct engine_kind
        *format;      /* whose scene files it reads; NULL: the suite's own, "dae" or "file" */
    bool takes_files; /* "file": the scene file is passed on as it is and never parsed */
    enum engine_output output;
    char image[8];    /* "exr" */
    unsigned feature; /* bits, features.h */
    /* One run per channel, with every colour of the scene replaced by the grey of that channel: for spectral
     * renderers. */
    bool separate;
    struct pixel_filter filter; /* of its images; the box of one pixel by default */
    bool
        shares_samples; /* a sample counts in each pixel whose filter reaches it: pixels are correlated */
    int depth_offset, spp, replicates;
    double scale; /* factor from its images' values to radiance */
    /* Declared error, relative, which widens the margins of every claim expected to be EQUIVALENT, and why; 0: none. */
    double margin_global, margin_tile;
    char margin_reason[512];
    json_t *json; /* owned; its arrays of strings have been checked */
};

/* The manifest's "version" where the description has no command for it. */
#define ENGINE_VERSION_UNKNOWN "unknown"

struct engine_options {
    int spp, replicates; /* 0: the description's */
    uint32_t seed;       /* replicate k's own seed is a hash of (seed, k) */
    int threads;
    double timeout_s;     /* of one process; it is killed (whole process group) after that */
    const char *work_dir; /* exists; gets a sub-directory, removed on success */
    /* NULL, or the hashes of images rendered earlier, "images_sha256" of a manifest: at the first image of "mean" that
     * is another or is not among them engine_render() sets *differs and, unless goes_on, ends. */
    const json_t *same_as;
    bool goes_on, *differs;
    /* NULL, or called with each image (RGB, 3 floats a pixel) of "mean" in their order. */
    void (*on_replicate)(void *ctx, int k, const float *pixels_rgb);
    void *on_replicate_ctx;
};

/* Fails, naming file and key, on what engine.md does not allow: unknown keys and placeholders, values
 * of the wrong type, a command without {scene} or {out}, "mean" without {seed}. */
NODISCARD bool engine_load(const char *path, struct engine *out, struct err *e);
/* The same for what a command line names: a file, or, without a dot or slash, SHARE/engines/NAME.json. */
NODISCARD bool engine_load_named(const char *name, const char *share_dir, struct engine *out,
                                 struct err *e);
void engine_free(struct engine *en);
/* Fails on "format": "file" where suite_dir is no suite of one's own. */
NODISCARD bool engine_fits_suite(const struct engine *en, const char *suite_dir, struct err *e);

/* The value of a placeholder. */
struct engine_value {
    const char *name, *value;
};
/* Concatenates the arguments of some keys ("command", "version", ...; NULL at the end), with placeholders replaced from
 * `values`, which end with a NULL name. Fails on a placeholder without a value. *argv is NULL-terminated and one
 * block of memory that the caller frees; absent keys add nothing. */
NODISCARD bool engine_argv(const struct engine *en, const char *const *keys,
                           const struct engine_value *values, char ***argv, struct err *e);

/* True if the engine can render the scene: it has all features, and the scene can be written in its
 * format. Else `why` is one line. Tries it in a temporary directory below dir, which must exist. */
NODISCARD bool engine_expresses(const struct engine *en, const struct suite_scene *scene,
                                const char *dir, struct err *why);

/* Renders. The caller frees *out and *manifest (a new reference). The unit of *out is "replicate", "exact", "sample"
 * or, for a single image whose noise is unknown, "picture". The manifest's members are those of reference_render.h,
 * plus "description_sha256", "files" (the hash of each file of {here} that the command names) and, of "mean",
 * "images_sha256" (of each image, as floats in memory) and, unless pixels share samples, "blocks" (block_means.h).
 * "mean": K runs with different seeds, folded. Fails, with the program's last lines, if it is missing, dies, hangs or
 * writes no image, an image of another size, without R, G and B, with pixels that are not finite, or the same image
 * for two seeds (unless that image has no noise at all: then it is "exact"), or if replicates fail
 * independence_check(). Its files are then kept, and the line names their directory. */
NODISCARD bool engine_render(const struct engine *en, const struct suite_scene *scene,
                             const struct engine_options *opt, struct moments *out,
                             json_t **manifest, struct err *e);

#endif
