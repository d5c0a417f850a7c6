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
    VERDICT_NOTHING_FOUND, /* "NO DIFFERENCE FOUND": no margin was declared; only the MDB is known */
    VERDICT_INCONCLUSIVE /* neither, or something that was asked for could not be tested */
};

struct suite_reference {
    char engine
        [32]; /* one with goldens (engine_table.h) or "truth"; in a suite of one's own also "pathtracer" or any
                             engine whose images are stored */
    char fidelity[16];    /* "class" in the file: "exact", "limit" (exact in the limit of its own
                             settings) or "approximate" */
    double margin_global; /* largest relative difference of the image mean that counts as equal */
    double margin_tile;   /* the same for one tile */
    double
        margin_variance; /* the same for the variance of a path, either way; 0: it is not judged */
    int replicates; /* engines: images with a seed of their own; 0: as many as its description says */
    int spp;        /* samples per pixel of one replicate (0 likewise), or */
    int subgrid;    /* k, if engine_kind.subgrid: a replicate is a box-averaged (k W) x (k H) image */
    char kind[32];  /* truth: which closed form (truth.h) */
    json_t *values; /* truth: its numbers; borrowed from the suite */
};

/* Another way for our renderer to compute the same image: further options of pathtracer. */
struct suite_variant {
    char name[64]; /* "pathtracer-hemisphere" */
    int spp;
    double margin_global, margin_tile; /* as for a reference; a variant has its own noise */
    const char *options[9];            /* NULL at the end; borrowed from the suite */
};

enum { MAX_VARIANTS = 8, MAX_REFERENCES = 8 };

struct suite_scene {
    char name[64];          /* "41_cornell" */
    char dae[4096];         /* path of the .dae; in a suite of one's own, of a file of any kind */
    bool is_opaque;         /* not COLLADA: only an engine with the format "file" reads it */
    char environment[4096]; /* path of an .exr or .hdr; empty if there is none */
    double lens_radius, focal_distance; /* as of struct camera; 0 and 0: pinhole */
    struct pixel_filter filter;         /* the box of one pixel unless an engine has its own */
    char sha256
        [65]; /* lower-case hex: of the .dae; with an environment, a lens or other files, of a text that
                        holds that hash, the lens, and the hashes of the environment and of these files */
    char title[128], detects[512], blind_to[512];
    char convention[512]; /* where correct renderers may differ; empty: nowhere */
    int width, height;
    int depth; /* -m: largest number of bounces */
    int spp;   /* of our render */
    int tile;  /* side of a reporting tile, pixels */
    enum verdict expect;
    struct suite_variant variant[MAX_VARIANTS];
    int num_variants;
    /* The check that renders with different seeds err as much as they state (tools/stats/stated_error.h);
     * 0 renders: no check. */
    struct {
        int renders, spp;
        double margin;
        double noise_margin; /* 0: not checked */
        int parts;           /* samples of the first of two shares; 0: not checked */
        int batch, most;     /* of one adaptive render; 0: not checked */
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
    bool is_own; /* loaded from a suite.json (suite_own.h) */
    char
        engine[4096]; /* if is_own: path of the description of the engine to judge; empty: none */
};

/* Loads all scenes of a directory: those of its suite.json if it has one, else all in it. A 9x scene inherits the
 * references of the scene that it names. Fails on an empty directory, and on a .dae without .json or vice versa. The
 * caller calls suite_free(). */
NODISCARD bool suite_load(const char *dir, struct suite *out, struct err *e);
void suite_free(struct suite *s);
/* Reads the scene with its environment, and its camera with its lens. The caller calls
 * scene_free(scene). */
NODISCARD bool suite_open(const struct suite_scene *s, struct scene *scene, struct camera *camera,
                          struct err *e);
/* NULL if there is none of that name. */
const struct suite_scene *suite_find(const struct suite *s, const char *name);
const struct suite_reference *suite_reference_of(const struct suite_scene *s, const char *engine);
/* Is `kind` a closed form whose noise is known, too (truth_noise.h)? */
bool suite_noise_is_known(const char *kind);

const char *verdict_name(enum verdict v); /* "EQUIVALENT", ... */
extern const char *const verdict_names[]; /* by enum verdict; end with NULL */
bool verdict_parse(const char *name, enum verdict *out);
/* EQUIVALENT and DIFFERENT: more samples would not change it. */
bool verdict_decides(enum verdict v);

#endif
