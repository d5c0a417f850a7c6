/* Renders one scene of the suite with one reference engine: K replicates with seeds of their own,
 * folded into moments (unit "replicate"), and a manifest that says how to do it again. */
#ifndef ASSAY_REFERENCE_RENDER_H
#define ASSAY_REFERENCE_RENDER_H

#include "reference/replicates/engine_driver.h"

/* *out and *manifest (a new jansson reference) belong to the caller. The manifest holds
 *   scene, scene_sha256, engine, date (UTC), unit, spp_of_unit, width, height, depth, replicates,
 *   spp, subgrid, seed, cpu_s, wall_s (of all of it, this process included),
 *   of engines: version, binary_sha256, command, settings, seeds, and independence (independence.h)
 *   unless the unit is "exact"; of "truth": kind, values.
 * Fails (with the engine's own last lines) when the engine is absent, dies, hangs, writes something
 * unreadable or replicates that are not independent, and when it cannot express the scene; what the
 * engine left is then kept, and the line names the directory. */
NODISCARD bool reference_render(const struct suite_scene *scene, const struct suite_reference *ref,
                                const struct reference_options *opt, struct moments *out,
                                json_t **manifest, struct err *e);

/* The same can be done in parts, anywhere and in any order: ranges of the images that an engine's reference is folded
 * from (replicate_images.h): reference_count(), reference_render_part() and reference_fold_parts() below. Not for
 * "truth". */

/* Can the engine express the scene, including its pixel filter? If not, *why says why. Not for "truth" and
 * "pathtracer". */
NODISCARD bool reference_is_expressible(const struct suite_scene *scene,
                                        const struct suite_reference *ref,
                                        const struct reference_options *opt, struct err *why);

/* Is the reference rendered and stored? Closed forms are computed, and our own program renders anew each time. */
bool reference_is_rendered(const struct suite_reference *ref);

/* The number of images that the reference is folded from. */
NODISCARD bool reference_count(const struct suite_scene *scene, const struct suite_reference *ref,
                               const struct reference_options *opt, int *num, struct err *e);
/* Renders images first .. last-1 into dir, which exists: picture_NNNN.exr (float32, exactly what the fold takes), each
 * checked, and, at the end, part.json: "of" (scene, its hash, engine, settings, seed), "first", "last", "said" (what
 * only the engine knows: version, hash of its binary ...), "cpu_s", "wall_s". */
NODISCARD bool reference_render_part(const struct suite_scene *scene,
                                     const struct suite_reference *ref,
                                     const struct reference_options *opt, int first, int last,
                                     const char *dir, struct err *e);
/* Returns what reference_render() would: bit-identical moments, and the same manifest except "date" and the times
 * "cpu_s" and "wall_s", which are sums over this call and all parts. dir: num directories of parts, in the order of
 * their images. Also fails unless these hold every image of this reference exactly once, all made by the same version
 * of the engine. */
NODISCARD bool reference_fold_parts(const struct suite_scene *scene,
                                    const struct suite_reference *ref,
                                    const struct reference_options *opt, const char *const *dir,
                                    int num, struct moments *out, json_t **manifest, struct err *e);

/* Writes golden/<scene>/<engine>.exr and golden/<scene>/manifest.json: an object with one member per engine,
 * reference_render()'s manifest and exr_sha256; other engines' members are kept. First the image is written beside
 * its place (.exr.next), then the manifest with its hash is renamed, then the image. So whenever a writer is killed,
 * golden_read() finds either the old pair or the new one. Several engines may be written at the same time. */
NODISCARD bool golden_write(const char *golden_dir, const char *scene, const char *engine,
                            const struct moments *m, json_t *manifest, struct err *e);
/* Finishes what a killed golden_write() began: if the manifest describes the .exr.next, it is moved into place, else
 * removed. */
NODISCARD bool golden_settle(const char *golden_dir, const char *scene, const char *engine,
                             struct err *e);
/* Removes the entry, then the image. True also if there is neither. */
NODISCARD bool golden_remove(const char *golden_dir, const char *scene, const char *engine,
                             struct err *e);
/* Fails if there is none, if its scene hash differs from scene->sha256 (a stale golden), if the
 * EXR's hash differs from the manifest's, or if size, depth, spp, replicates are not those of the
 * suite. The caller frees *out and *manifest (a new reference). */
NODISCARD bool golden_read(const char *golden_dir, const struct suite_scene *scene,
                           const struct suite_reference *ref, struct moments *out,
                           json_t **manifest, struct err *e);
/* Fails unless that reference was stored with the scene's pixel filter: the one that the engine's description in its
 * manifest names, else the box of one pixel. */
NODISCARD bool golden_has_filter(const json_t *manifest, const struct suite_scene *scene,
                                 const char *engine, struct err *e);

enum golden_state {
    GOLDEN_CURRENT, /* golden_read() accepts it */
    GOLDEN_STALE,   /* whole, but of another scene file or other settings */
    GOLDEN_MISSING, /* not in the manifest */
    GOLDEN_DAMAGED /* manifest unreadable, image gone, or not the one that the manifest describes */
};
struct golden {
    enum golden_state state;
    struct moments m; /* if current or stale; else empty */
    json_t *manifest; /* likewise; owned */
    struct err why;   /* why it is not current */
};
/* The caller calls golden_free(). */
void golden_inspect(const char *golden_dir, const struct suite_scene *scene,
                    const struct suite_reference *ref, struct golden *out);
void golden_free(struct golden *g);
/* False if golden_inspect() would say GOLDEN_MISSING; does not read the image. */
bool golden_is_there(const char *golden_dir, const struct suite_scene *scene,
                     const struct suite_reference *ref);
const char *golden_state_name(enum golden_state state);
/* "scene/engine" of each stored image or manifest entry that the suite has no reference for: the
 * members of a new object. Empty if the directory does not exist. */
NODISCARD bool golden_orphans(const char *golden_dir, const struct suite *suite, json_t **names,
                              struct err *e);

/* Hash of all that decides the bits of an engine's reference on one machine: scene, settings, seed, the
 * driver's key file, its scripts, the engine's binary. A stored reference with this "key" in its
 * manifest need not be rendered again. Fails if the engine is absent or cannot express the scene. */
NODISCARD bool reference_key(const struct suite_scene *scene, const struct suite_reference *ref,
                             const struct reference_options *opt, char key[65], struct err *e);

#endif
