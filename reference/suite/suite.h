/* The suite: reference/scenes/NN_name.dae with NN_name.json beside it (what to render, against which references, inside
 * which margins, what must come out: tools/docs/formats/scene.md) and NN_name.md (what it can detect, what it is blind
 * to, and, for closed forms, the derivation). Families by number: 1x closed form, 2x BSDF, 3x light, 4x whole scene,
 * 5x and 6x pairs of features, 9x must differ. An unknown key, a missing key, a value out of range is an error with file and reason. */
#ifndef ASSAY_SUITE_H
#define ASSAY_SUITE_H

#include "engine_table.h"
#include "renderer/scene/camera.h"
#include "renderer/base/err.h"

#include <jansson.h>

/* What each means, and who says it: tools/docs/background/verdict.md. */
enum verdict {
    VERDICT_EQUIVALENT, /* inside a margin that was declared; never without one */
    VERDICT_DIFFERENT,
    VERDICT_NOTHING_FOUND, /* "NO DIFFERENCE FOUND": no margin was declared, and nothing is known but its MDB */
    VERDICT_INCONCLUSIVE /* neither, or something that was asked for could not be tested */
};

struct suite_reference {
    char engine
        [32]; /* of engine_table.h, with goldens, or "truth"; in a suite of one's own also "pathtracer", or the
                             name of what is stored, of any engine */
    char fidelity[16];    /* "class" in the file: "exact", "limit" (exact in the limit of its own
                             settings) or "approximate" */
    double margin_global; /* largest relative difference of the image mean that counts as equal */
    double margin_tile;   /* the same for one tile */
    int replicates; /* engines: images with a seed of their own; 0: as many as its description says */
    int spp;        /* samples per pixel of one replicate (0 likewise), or */
    int subgrid;    /* (engine_kind.subgrid) one is a box-averaged (k W) x (k H) image */
    char kind[32];  /* truth: which closed form (truth.h) */
    json_t *values; /* truth: its numbers; borrowed from the suite */
};

/* Another way of ours to the same image: further options of pathtracer. */
struct suite_variant {
    char name[64]; /* "pathtracer-hemisphere" */
    int spp;
    double margin_global, margin_tile; /* as of a reference: its noise is its own */
    const char *options[9];            /* NULL at the end; borrowed from the suite */
};

enum { MAX_VARIANTS = 8, MAX_REFERENCES = 8 };

struct suite_scene {
    char name[64];          /* "41_cornell" */
    char dae[4096];         /* path of the .dae, in a suite of one's own of any file */
    bool is_opaque;         /* not COLLADA: only an engine with the format "file" reads it */
    char environment[4096]; /* path of an .exr or .hdr; empty if there is none */
    double lens_radius, focal_distance; /* as of struct camera; 0 and 0: pinhole */
    struct pixel_filter filter;         /* the box of one pixel, but where an engine has its own */
    char sha256
        [65]; /* lower-case hex: of the .dae; with an environment, a lens or other files, of a text that
                        holds that, the environment's, the lens and the files that it uses */
    char title[128], detects[512], blind_to[512];
    char convention[512]; /* where correct renderers may differ; empty: nowhere */
    int width, height;
    int depth; /* -m: largest number of bounces */
    int spp;   /* of our render */
    int tile;  /* side of a reporting tile, pixels */
    enum verdict expect;
    struct suite_variant variant[MAX_VARIANTS];
    int num_variants;
    /* Renders with seeds of their own that must err as much as they say (tools/stats/stated_error.h); 0
     * renders: not asked. */
    struct {
        int renders, spp;
        double margin;
        double noise_margin; /* 0: not asked */
        int parts;           /* samples of the first of two shares; 0: not asked */
        int batch, most;     /* of one adaptive render; 0: not asked */
        double tolerance;
    } consistency;
    json_t *not_expressible; /* borrowed: {engine: reason}, or NULL */
    char references_of[64];  /* name of the scene whose references are used; its own name by default
                             */
    struct suite_reference reference[MAX_REFERENCES];
    int num_references;
    json_t *json; /* owned */
};

struct suite {
    struct suite_scene *scene; /* sorted by name */
    int num_scenes;
    bool is_own; /* of a suite.json: suite_own.h */
    char
        engine[4096]; /* of that: path of the description of what is judged; empty: none is named */
};

/* Loads all scenes of a directory: those of its suite.json, else all that stand in it. A 9x scene inherits the `references` object of the scene it
 * names. Fails on an empty directory, a .dae without .json and the reverse. */
NODISCARD bool suite_load(const char *dir, struct suite *out, struct err *e);
void suite_free(struct suite *s);
/* Reads the scene with its environment, and its camera with its lens. The caller calls
 * scene_free(scene). */
NODISCARD bool suite_open(const struct suite_scene *s, struct scene *scene, struct camera *camera,
                          struct err *e);
/* NULL if there is none of that name. */
const struct suite_scene *suite_find(const struct suite *s, const char *name);
const struct suite_reference *suite_reference_of(const struct suite_scene *s, const char *engine);
/* Closed forms for which truth_noise.h has the noise, too. */
bool suite_noise_is_known(const char *kind);

const char *verdict_name(enum verdict v); /* "EQUIVALENT", ... */
extern const char *const verdict_names[]; /* by enum verdict; end with NULL */
bool verdict_parse(const char *name, enum verdict *out);
/* EQUIVALENT and DIFFERENT: more samples would not change it. */
bool verdict_decides(enum verdict v);

#endif
