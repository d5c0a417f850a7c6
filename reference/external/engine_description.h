/* Any renderer, by a small JSON file that says how to call it and what it can do: tools/docs/formats/engine.md. Commands
 * run without a shell. */
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
    bool takes_files; /* "file": the scene as it is, whatever it is; nobody looks into it */
    enum engine_output output;
    char image[8];    /* "exr" */
    unsigned feature; /* bits, features.h */
    /* A render for each channel, with all that the scene has in grey, as that channel is: for programs that make spectra of colours. */
    bool separate;
    struct pixel_filter filter; /* of its images; the box of one pixel by default */
    bool
        shares_samples; /* a sample counts in each pixel whose filter reaches it: pixels are correlated */
    int depth_offset, spp, replicates;
    double scale; /* of its images' numbers, to be radiance */
    /* How far it may be off in every scene that is to be EQUIVALENT, whatever that scene's margins are, and why; 0: no more. */
    double margin_global, margin_tile;
    char margin_reason[512];
    json_t *json; /* owned; arrays of texts that were checked */
};

struct engine_options {
    int spp, replicates; /* 0: the description's */
    uint32_t seed;       /* replicate k's own seed is a hash of (seed, k) */
    int threads;
    double timeout_s;     /* of one process; it is killed (whole process group) after that */
    const char *work_dir; /* exists; gets a sub-directory, removed on success */
    /* Replicates that are not independent are an error, and the manifest says how independent they are (independence.h). */
    bool check_independence;
};

/* Fails, naming file and key, on what engine.md does not allow: unknown keys and placeholders, values
 * of the wrong type, a command without {scene} or {out}, "mean" without {seed}. */
NODISCARD bool engine_load(const char *path, struct engine *out, struct err *e);
void engine_free(struct engine *en);

/* What stands for a placeholder. */
struct engine_value {
    const char *name, *value;
};
/* argv of some keys ("command", "version", ...; NULL at the end) one behind the other, placeholders filled in from `values`, which
 * end with a NULL name. A placeholder without a value fails. *argv is one block of memory that the
 * caller frees, NULL-terminated; absent keys add nothing. */
NODISCARD bool engine_argv(const struct engine *en, const char *const *keys,
                           const struct engine_value *values, char ***argv, struct err *e);

/* True if the engine can render the scene: it has all features, and the scene can be written in its
 * format. Else `why` is one line. Tries it in a directory below dir, which exists. */
NODISCARD bool engine_expresses(const struct engine *en, const struct suite_scene *scene,
                                const char *dir, struct err *why);

/* Renders. *out (unit "replicate", "exact", "sample" or, of one noisy image, of whose noise nothing is known, "picture") and *manifest (a new reference) belong to the
 * caller; the manifest's members are those of reference_render.h, with "description_sha256" and "files" (the
 * hash of each file of {here} that the command names). "mean": K runs with seeds of their own, folded.
 * Fails, with the program's own last lines, when it is not there, dies, hangs or writes no image, an
 * image of another size, without R, G and B, with pixels that are not finite, or the same image
 * for two seeds (unless no pixel of it has any noise: then it is "exact"). What it left is then kept,
 * and the line names the directory. */
NODISCARD bool engine_render(const struct engine *en, const struct suite_scene *scene,
                             const struct engine_options *opt, struct moments *out,
                             json_t **manifest, struct err *e);

#endif
