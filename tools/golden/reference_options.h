/* The command line of `assay reference`, the references that it selects and their states; used by the verb and by
 * job_reference.c, which plans it as jobs. */
#ifndef ASSAY_REFERENCE_OPTIONS_H
#define ASSAY_REFERENCE_OPTIONS_H

#include "reference/external/engine_description.h"
#include "reference/store/reference_render.h"

enum { REFERENCE_MOST_SCENES = 64 };

struct reference_command {
    const char *only[REFERENCE_MOST_SCENES], *engine, *out, *golden, *suite_dir, *work;
    const char *as;          /* with --engine FILE: the reference that it makes */
    struct engine described; /* of --engine FILE; its name is empty where there is none */
    int num_only;
    struct reference_options opt;
    int seed;        /* negative: none was given */
    int first, last; /* --images; last 0: all */
    bool fresh, noise, slurm, quiet, help;
    struct suite suite;
};

/* Reads the command line and the suite, and makes the directory for temporary files. help: it has been printed, and
 * nothing else is done. The caller calls reference_options_free(), even after a failure. */
NODISCARD bool reference_options_read(int argc, char **argv, struct reference_command *c,
                                      struct err *e);
void reference_options_free(struct reference_command *c);

/* Is the scene selected, and has it references of its own? */
bool reference_options_selects(const struct reference_command *c, const struct suite_scene *scene);
/* Calls one() for each selected reference, in the order of the suite, until it returns false. Fails then, and if no
 * reference is selected. */
NODISCARD bool reference_options_each(const struct reference_command *c,
                                      bool (*one)(void *ctx, const struct suite_scene *scene,
                                                  const struct suite_reference *ref, struct err *e),
                                      void *ctx, struct err *e);

/* How a reference would be rendered, and where an up-to-date one is stored. */
struct reference_state {
    struct reference_options opt; /* with its seed */
    char key[65];                 /* reference_key() */
    const char *there;            /* in --golden or --out; NULL: to be rendered */
};
NODISCARD bool reference_options_state(const struct reference_command *c,
                                       const struct suite_scene *scene,
                                       const struct suite_reference *ref,
                                       struct reference_state *out, struct err *e);
/* Prints that it is up to date. If that is in --golden, removes a candidate in --out that is not. */
NODISCARD bool reference_options_keep(const struct reference_command *c,
                                      const struct suite_scene *scene,
                                      const struct suite_reference *ref,
                                      const struct reference_state *state, struct err *e);
/* Writes a rendered reference to --out, with the key in its manifest, and prints that. */
NODISCARD bool reference_options_write(const struct reference_command *c,
                                       const struct suite_scene *scene,
                                       const struct suite_reference *ref, const char *key,
                                       const struct moments *m, json_t *manifest, double seconds,
                                       struct err *e);

#endif
