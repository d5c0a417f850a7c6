/* The command `assay reference`: its arguments, what they select, the state of each reference; for the verb and for
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
    bool fresh, noise, slurm, help;
    struct suite suite;
};

/* Reads the words and the suite, and makes the directory for temporary files. help: it was printed, and no more was
 * done. The caller calls reference_options_free(), also after a failure. */
NODISCARD bool reference_options_read(int argc, char **argv, struct reference_command *c,
                                      struct err *e);
void reference_options_free(struct reference_command *c);

/* Is the scene asked for, and has references of its own? */
bool reference_options_selects(const struct reference_command *c, const struct suite_scene *scene);
/* Calls one() for each reference that is asked for, in the order of the suite, as long as it returns true. Fails if there is
 * none. */
NODISCARD bool reference_options_each(const struct reference_command *c,
                                      bool (*one)(void *ctx, const struct suite_scene *scene,
                                                  const struct suite_reference *ref, struct err *e),
                                      void *ctx, struct err *e);

/* How one of them would be made, and where it is up to date already. */
struct reference_state {
    struct reference_options opt; /* with its seed */
    char key[65];                 /* reference_key() */
    const char *there;            /* --golden or --out; NULL: to be rendered */
};
NODISCARD bool reference_options_state(const struct reference_command *c,
                                       const struct suite_scene *scene,
                                       const struct suite_reference *ref,
                                       struct reference_state *out, struct err *e);
/* Says that it is up to date; a candidate that is older than what is stored is removed. */
NODISCARD bool reference_options_keep(const struct reference_command *c,
                                      const struct suite_scene *scene,
                                      const struct suite_reference *ref,
                                      const struct reference_state *state, struct err *e);
/* Writes it to --out with the key in its manifest, and says so. */
NODISCARD bool reference_options_write(const struct reference_command *c,
                                       const struct suite_scene *scene,
                                       const struct suite_reference *ref, const char *key,
                                       const struct moments *m, json_t *manifest, double seconds,
                                       struct err *e);

#endif
