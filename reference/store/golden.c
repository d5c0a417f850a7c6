/* Stored references (goldens): reads, checks, writes and removes golden/SCENE/. */
#define _GNU_SOURCE
#include "reference_render.h"

#include "renderer/base/sha256.h"
#include "renderer/base/fs.h"
#include "reference/base/json_file.h"
#include "reference/base/json_node.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

/* The files of one engine's reference. next: an image that the manifest may not describe yet. */
struct place {
    struct path exr, next, manifest;
};

static struct place find_place(const char *golden_dir, const char *scene, const char *engine)
{
    return (struct place){.exr = fs_path("%s/%s/%s.exr", golden_dir, scene, engine),
                          .next = fs_path("%s/%s/%s.exr.next", golden_dir, scene, engine),
                          .manifest = fs_path("%s/%s/manifest.json", golden_dir, scene)};
}

/* The lock held while the manifest is read, changed and renamed, so that engines of one scene may finish
 * at the same time. Returns a descriptor that releases it when closed, or -1. */
static int lock_directory(const char *golden_dir, const char *scene, struct err *e)
{
    const struct path dir = fs_path("%s/%s", golden_dir, scene);
    if (!fs_make_dirs(dir.s, e))
        return -1;
    int fd = open(dir.s, O_RDONLY | O_DIRECTORY | O_CLOEXEC), r = -1;
    if (fd >= 0)
        do
            r = flock(fd, LOCK_EX);
        while (r != 0 && errno == EINTR);
    if (r == 0)
        return fd;
    err_set(e, "%s: cannot lock: %s", dir.s, strerror(errno));
    if (fd >= 0)
        close(fd);
    return -1;
}

/* *has: the file exists and has the entry's hash. Fails if it exists but cannot be read. */
static bool look_at_hash(const char *path, const json_t *entry, bool *has, struct err *e)
{
    char sha256[65];
    const char *want = json_string_value(json_object_get(entry, "exr_sha256"));
    *has = false;
    if (want == NULL || access(path, F_OK) != 0)
        return true;
    if (!sha256_file(path, sha256, e))
        return false;
    *has = strcmp(want, sha256) == 0;
    return true;
}

/* Which file is the image of an entry: after an interruption it may still be `next`. A file that cannot be read is
 * not. */
static const char *image_of(const json_t *entry, const char *exr, const char *next)
{
    struct err ignored;
    bool here, waits;
    return (!look_at_hash(exr, entry, &here, &ignored) || !here) &&
                   look_at_hash(next, entry, &waits, &ignored) && waits
               ? next
               : exr;
}

/* Under the lock nobody writes, so `next` was left by a killed writer: moved into place if the manifest describes it,
 * else removed. */
static bool settle(const json_t *entry, const char *exr, const char *next, struct err *e)
{
    if (access(next, F_OK) != 0)
        return true;
    bool here, waits;
    if (!look_at_hash(exr, entry, &here, e) || !look_at_hash(next, entry, &waits, e))
        return false;
    int r = waits && !here ? rename(next, exr) : unlink(next);
    return r == 0 || err_set(e, "%s: cannot write: %s", exr, strerror(errno));
}

bool golden_settle(const char *golden_dir, const char *scene, const char *engine, struct err *e)
{
    const struct place at = find_place(golden_dir, scene, engine);
    if (access(at.next.s, F_OK) != 0)
        return true;
    int lock = lock_directory(golden_dir, scene, e);
    if (lock < 0)
        return false;
    json_t *all = json_read_object(at.manifest.s, e);
    bool ok = all != NULL && settle(json_object_get(all, engine), at.exr.s, at.next.s, e);
    json_decref(all);
    close(lock);
    return ok;
}

/* Block means are as long as an image: an attribute of it, of which the manifest keeps the rest. */
static const char blocks_attr[] = "assay:blocks";

/* Reads them into a copy of the entry, a new reference; NULL: out of memory. */
static json_t *with_blocks(const json_t *entry, const char *exr)
{
    json_t *copy = json_copy((json_t *)entry), *blocks = json_copy(json_object_get(copy, "blocks"));
    struct image head;
    struct err ignored;
    if (blocks != NULL && image_read_exr_head(exr, &head, &ignored)) {
        const char *values = image_get_attr(&head, blocks_attr);
        json_object_set_new(blocks, "values", json_string(values));
        json_object_set(copy, "blocks", blocks);
        image_free(&head);
    }
    json_decref(blocks);
    return copy;
}

/* The new image waits beside the old one until the manifest names it by its hash; the manifest's rename decides.
 * Whatever a kill leaves, image_of() finds the image that the manifest describes. */
bool golden_write(const char *golden_dir, const char *scene, const char *engine,
                  const struct moments *m, json_t *manifest, struct err *e)
{
    char sha256[65];
    const struct place at = find_place(golden_dir, scene, engine);
    int lock = lock_directory(golden_dir, scene, e);
    if (lock < 0)
        return false;
    json_t *all = json_read_object(at.manifest.s, e), *entry = json_copy(manifest),
           *blocks = json_copy(json_object_get(manifest, "blocks"));
    const char *values = member_text(blocks, "values");
    const struct image_attr attrs[] = {
        {"assay:scene", scene}, {"assay:engine", engine}, {blocks_attr, values}};
    bool ok = all != NULL && settle(json_object_get(all, engine), at.exr.s, at.next.s, e);
    bool waits = ok && moments_write(at.next.s, m, attrs, values != NULL ? 3 : 2, e);
    ok = waits && sha256_file(at.next.s, sha256, e);
    if (ok) {
        json_object_set_new(entry, "exr_sha256", json_string(sha256));
        json_object_del(blocks, "values");
        if (blocks != NULL)
            json_object_set(entry, "blocks", blocks);
        json_object_set(all, engine, entry);
        ok = json_write(at.manifest.s, all, e);
    }
    if (waits && !ok)
        unlink(at.next.s); /* no manifest names it */
    if (ok && rename(at.next.s, at.exr.s) != 0)
        ok = err_set(e, "%s: cannot write: %s", at.exr.s, strerror(errno));
    json_decref(entry);
    json_decref(blocks);
    json_decref(all);
    close(lock);
    return ok;
}

bool golden_remove(const char *golden_dir, const char *scene, const char *engine, struct err *e)
{
    const struct place at = find_place(golden_dir, scene, engine);
    if (access(at.manifest.s, F_OK) != 0 && access(at.exr.s, F_OK) != 0)
        return true;
    int lock = lock_directory(golden_dir, scene, e);
    if (lock < 0)
        return false;
    json_t *all = json_read_object(at.manifest.s, e);
    bool ok = all != NULL;
    if (ok && json_object_del(all, engine) == 0)
        ok = json_write(at.manifest.s, all, e);
    if (ok &&
        ((unlink(at.exr.s) != 0 && errno != ENOENT) || (unlink(at.next.s) != 0 && errno != ENOENT)))
        ok = err_set(e, "%s: cannot remove: %s", at.exr.s, strerror(errno));
    json_decref(all);
    close(lock);
    return ok;
}

static bool check_number(const json_t *entry, const char *key, int want, const char *where,
                         struct err *e)
{
    const json_t *v = json_object_get(entry, key);
    if (!json_is_integer(v))
        return err_set(e, "%s: '%s' is missing", where, key);
    if (json_integer_value(v) != want)
        return err_set(e, "%s: golden has %s %lld, the suite wants %d: make it again", where, key,
                       (long long)json_integer_value(v), want);
    return true;
}

static bool check_string(const json_t *entry, const char *key, const char *want, const char *where,
                         const char *why, struct err *e)
{
    const char *v = json_string_value(json_object_get(entry, key));
    if (v == NULL)
        return err_set(e, "%s: '%s' is missing", where, key);
    return strcmp(v, want) == 0 || err_set(e, "%s: %s", where, why);
}

/* Was the entry made for this scene file and these settings of the suite? */
static bool check_entry(const json_t *entry, const struct suite_scene *scene,
                        const struct suite_reference *ref, const char *where, struct err *e)
{
    if (!check_string(entry, "scene_sha256", scene->sha256, where,
                      "stale golden: the scene file has changed since: make it again", e) ||
        !check_string(entry, "engine", ref->engine, where, "golden of another engine", e) ||
        !check_number(entry, "width", scene->width, where, e) ||
        !check_number(entry, "height", scene->height, where, e) ||
        !check_number(entry, "depth", scene->depth, where, e))
        return false;
    /* For an engine that this program does not know, 0 stands for what its description said then. */
    const bool free = engine_with_goldens(ref->engine) == NULL && strcmp(ref->engine, "truth") != 0;
    if ((!(free && ref->replicates == 0) &&
         !check_number(entry, "replicates", ref->replicates, where, e)) ||
        (!(free && ref->spp == 0) && !check_number(entry, "spp", ref->spp, where, e)) ||
        !check_number(entry, "subgrid", ref->subgrid, where, e))
        return false;
    if (strcmp(ref->engine, "truth") != 0)
        return true;
    return check_string(entry, "kind", ref->kind, where, "golden of another closed form", e) &&
           (json_equal(json_object_get(entry, "values"), ref->values) ||
            err_set(e, "%s: stale golden: the closed form's values have changed: make it again",
                    where));
}

/* Do the image's size, unit and n agree with its manifest? */
static bool check_moments(const struct moments *m, const json_t *entry, const char *exr,
                          struct err *e)
{
    json_int_t width = json_integer_value(json_object_get(entry, "width"));
    json_int_t height = json_integer_value(json_object_get(entry, "height"));
    if (m->width != width || m->height != height)
        return err_set(e, "%s: %d x %d pixels, its manifest says %lld x %lld", exr, m->width,
                       m->height, (long long)width, (long long)height);
    if (!check_string(entry, "unit", m->unit, exr, "its unit is not that of its manifest", e))
        return false;
    /* "sample": n may differ between pixels; "picture": n is not a count. */
    if (strcmp(m->unit, "sample") == 0 || moments_noise_is_unknown(m))
        return true;
    double n = moments_is_exact(m) ? 1 : json_number_value(json_object_get(entry, "replicates"));
    for (size_t p = 0; p < (size_t)m->width * (size_t)m->height; p++)
        if (m->n[p] != n)
            return err_set(e, "%s: pixel %zu holds %g observations, not %g", exr, p, m->n[p], n);
    return true;
}

/* Reads the image if it and the entry belong together, current or not. */
static bool read_pair(const char *exr, const json_t *entry, struct moments *out, struct err *e)
{
    char sha256[65];
    struct moments m = {0};
    if (!sha256_file(exr, sha256, e) ||
        !check_string(entry, "exr_sha256", sha256, exr, "not the image that its manifest describes",
                      e) ||
        !moments_read(exr, &m, NULL, e))
        return false;
    if (!check_moments(&m, entry, exr, e)) {
        moments_free(&m);
        return false;
    }
    *out = m;
    return true;
}

void golden_inspect(const char *golden_dir, const struct suite_scene *scene,
                    const struct suite_reference *ref, struct golden *out)
{
    const struct place at = find_place(golden_dir, scene->name, ref->engine);
    char where[PATH_MAX + 64];
    *out = (struct golden){.state = GOLDEN_DAMAGED};
    struct err *e = &out->why;
    json_t *all = json_read_object(at.manifest.s, e);
    if (all == NULL)
        return;
    snprintf(where, sizeof where, "%s: %s", at.manifest.s, ref->engine);
    json_t *entry = json_object_get(all, ref->engine);
    struct err stale = {0};
    if (!json_is_object(entry)) {
        out->state = GOLDEN_MISSING;
        err_set(e, "%s: no golden of %s%s", at.exr.s, ref->engine,
                engine_with_goldens(ref->engine) != NULL ? ": `make golden` makes it" : "");
    } else {
        bool fits = check_entry(entry, scene, ref, where, &stale);
        const char *exr = image_of(entry, at.exr.s, at.next.s);
        if (read_pair(exr, entry, &out->m, e)) {
            out->state = fits ? GOLDEN_CURRENT : GOLDEN_STALE;
            out->manifest = with_blocks(entry, exr);
        }
        if (!fits)
            *e = stale;
    }
    json_decref(all);
}

bool golden_has_filter(const json_t *manifest, const struct suite_scene *scene, const char *engine,
                       struct err *e)
{
    const json_t *settings = json_object_get(manifest, "settings");
    const char *stored = member_text(json_object_get(settings, "description"), "filter");
    struct pixel_filter filter;
    char has[PIXEL_FILTER_TEXT], wanted[PIXEL_FILTER_TEXT];
    if (!pixel_filter_parse(stored != NULL ? stored : "box", &filter, e))
        return err_prefix(e, "%s, %s: the manifest", scene->name, engine);
    pixel_filter_print(&filter, has);
    pixel_filter_print(&scene->filter, wanted);
    return strcmp(has, wanted) == 0 || err_set(e, "%s, %s: stored with the pixel filter %s, not %s",
                                               scene->name, engine, has, wanted);
}

bool golden_is_there(const char *golden_dir, const struct suite_scene *scene,
                     const struct suite_reference *ref)
{
    struct err ignored;
    json_t *all =
        json_read_object(find_place(golden_dir, scene->name, ref->engine).manifest.s, &ignored);
    const bool there = all == NULL || json_is_object(json_object_get(all, ref->engine));
    json_decref(all);
    return there;
}

void golden_free(struct golden *g)
{
    moments_free(&g->m);
    json_decref(g->manifest);
    *g = (struct golden){.state = GOLDEN_MISSING};
}

const char *golden_state_name(enum golden_state state)
{
    static const char *const names[] = {[GOLDEN_CURRENT] = "current",
                                        [GOLDEN_STALE] = "stale",
                                        [GOLDEN_MISSING] = "missing",
                                        [GOLDEN_DAMAGED] = "damaged"};
    return names[state];
}

bool golden_read(const char *golden_dir, const struct suite_scene *scene,
                 const struct suite_reference *ref, struct moments *out, json_t **manifest,
                 struct err *e)
{
    struct golden g;
    golden_inspect(golden_dir, scene, ref, &g);
    if (g.state != GOLDEN_CURRENT) {
        *e = g.why;
        golden_free(&g);
        return false;
    }
    *out = g.m;
    *manifest = g.manifest;
    return true;
}

static bool is_wanted(const struct suite *suite, const char *scene, const char *engine)
{
    const struct suite_scene *s = suite_find(suite, scene);
    return s != NULL && strcmp(s->references_of, s->name) == 0 &&
           suite_reference_of(s, engine) != NULL;
}

/* Adds the orphans in one scene's directory, manifest entries and images. */
static bool add_orphans(const char *golden_dir, const struct suite *suite, const char *scene,
                        json_t *found, struct err *e)
{
    char name[PATH_MAX];
    const struct path dir = fs_path("%s/%s", golden_dir, scene);
    DIR *d = opendir(dir.s);
    if (d == NULL)
        return errno == ENOTDIR || err_set(e, "%s: %s", dir.s, strerror(errno));
    struct dirent *entry;
    while ((entry = readdir(d)) != NULL) {
        const char *dot = strrchr(entry->d_name, '.');
        if (dot == NULL || strcmp(dot, ".exr") != 0)
            continue;
        snprintf(name, sizeof name, "%.*s", (int)(dot - entry->d_name), entry->d_name);
        if (is_wanted(suite, scene, name))
            continue;
        snprintf(name, sizeof name, "%s/%.*s", scene, (int)(dot - entry->d_name), entry->d_name);
        json_object_set_new(found, name, json_true());
    }
    closedir(d);
    json_t *all = json_read_object(fs_path("%s/manifest.json", dir.s).s, e);
    const char *engine;
    json_t *value;
    json_object_foreach(all, engine, value) {
        snprintf(name, sizeof name, "%s/%s", scene, engine);
        if (!is_wanted(suite, scene, engine))
            json_object_set_new(found, name, json_true());
    }
    json_decref(all);
    return all != NULL;
}

bool golden_orphans(const char *golden_dir, const struct suite *suite, json_t **names,
                    struct err *e)
{
    DIR *d = opendir(golden_dir);
    if (d == NULL && errno != ENOENT)
        return err_set(e, "%s: %s", golden_dir, strerror(errno));
    json_t *found = json_object();
    bool ok = true;
    struct dirent *entry;
    while (ok && d != NULL && (entry = readdir(d)) != NULL)
        /* The catalogue of bugs (tools/diagnose/catalogue.h) has a manifest of its own kind. */
        if (entry->d_name[0] != '.' && strcmp(entry->d_name, "diagnose") != 0)
            ok = add_orphans(golden_dir, suite, entry->d_name, found, e);
    if (d != NULL)
        closedir(d);
    *names = ok ? json_incref(found) : NULL;
    json_decref(found);
    return ok;
}
