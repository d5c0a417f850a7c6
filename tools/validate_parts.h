/* What the parts of validate.c share: the run, the images of both sides (validate_side.c) and the
 * judging of one against another (validate_claim.c). */
#ifndef ASSAY_VALIDATE_PARTS_H
#define ASSAY_VALIDATE_PARTS_H

#include "../renderer/moments.h"
#include "validate.h"

enum { MAX_PATH = 8192 };

enum { MAX_REFERENCES = 3 };

/* One side of a claim: an image, how it came to be, or why there is none. */
struct side {
    struct moments m;
    json_t *manifest; /* of a reference; NULL for ours */
    double seconds;
    bool tried, present;
    struct err e;
};

struct validation {
    const struct validate_options *opt;
    struct suite suite;
    const struct suite_scene **order;         /* in which scenes are judged */
    struct side (*reference)[MAX_REFERENCES]; /* per scene: 9x scenes share those of another */
    json_t *claims, *consistency;
    bool *engine_can; /* per scene: the further engine can express it */
    double alpha;     /* of one claim */
    int num_claims, done;
};

void side_free(struct side *s);
/* out_dir/data/scene/file; path has MAX_PATH characters. */
void data_path(const struct validation *v, char *path, const char *scene, const char *file);
/* A line of progress. */
void say(const struct validation *v, const char *scene, const char *what);

/* Each fills *out, of which the caller calls side_free(); what went wrong is in out->e. variant: NULL,
 * or another way of ours. */
void render_ours(const struct validation *v, const struct suite_scene *s, const char *name,
                 const struct suite_variant *variant, struct side *out);
void render_engine(const struct validation *v, const struct suite_scene *s, struct side *out);
/* The image of one reference of scene s, also as a file for the report. Each is made once a run. */
const struct side *get_reference(struct validation *v, const struct suite_scene *s, int i);

/* Ours against each reference; each engine against the closed form, where there is one: the probes
 * that show the engine to be set up right; and a further engine against all of these and ours. */
int count_claims(const struct validation *v, const struct suite_scene *s);
/* Judges a (of scene s) against b (of scene `from`) and appends the claim. */
void judge(struct validation *v, const struct suite_scene *s, const struct suite_scene *from,
           const char *a_name, const struct side *a, const struct suite_reference *ref,
           const struct side *b);

#endif
