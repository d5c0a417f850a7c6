/* From a reference to the element that it names, in this document or in a file beside it. */
#include "collada_internal.h"
#include "renderer/base/fs.h"

#include <errno.h>
#include <libxml/uri.h>
#include <stdlib.h>
#include <string.h>

/* The element of that id in a document. */
static const xmlNode *find(struct loader *ld, const struct document *in, const xmlNode *user,
                           const char *id, const char *element)
{
    const void *entry = xmlHashLookup(in->ids, (const xmlChar *)id);
    const xmlNode *hit = entry;
    if (hit == NULL)
        fail_at(ld, user, "no element with id '%.200s'", id);
    else if (entry == in)
        fail_at(ld, user, "more than one element has id '%.200s'", id);
    else if (!element_is(hit, element))
        fail_at(ld, user, "'%.200s' is a <%.60s>, not a <%s>", id, (const char *)hit->name,
                element);
    return ld->failed ? NULL : hit;
}

const xmlNode *reference_find(struct loader *ld, const xmlNode *n, const char *id,
                              const char *element)
{
    return find(ld, element_document(n), n, id, element);
}

/* The document that the first `size` bytes of a reference name, relative to the one of n. NULL: failed. */
static const struct document *open_beside(struct loader *ld, const xmlNode *n,
                                          const char *reference, size_t size)
{
    struct scene *s = &ld->scene;
    char resolved[PATH_MAX], other[PATH_MAX];
    struct path name = fs_path("%.*s", (int)size, reference);
    if (!element_document(n)->is_file || size >= PATH_MAX || reference[0] == '/' ||
        memchr(reference, ':', size) != NULL) {
        fail_at(ld, n, "reference '%.200s' leads elsewhere than to a file beside this one",
                reference);
        return NULL;
    }
    xmlURIUnescapeString(name.s, 0, name.s);
    struct path path = fs_beside_file(element_document(n)->path, name.s);
    bool exists = realpath(path.s, resolved) != NULL;
    for (size_t i = 0; exists && i < ld->num_documents; i++)
        if (realpath(ld->documents[i]->path, other) != NULL && strcmp(other, resolved) == 0)
            return ld->documents[i];
    FILE *file = exists ? fs_open(path.s) : NULL;
    if (file == NULL) {
        fail_at(ld, n, "reference '%.200s': cannot read: %s", reference, strerror(errno));
        return NULL;
    }
    const struct document *d = NULL;
    char *kept = strdup(path.s);
    s->documents = build_grow(ld, s->documents, sizeof *s->documents, s->num_documents);
    if (kept == NULL || ld->failed) {
        element_fail_memory(ld);
        free(kept);
    } else {
        s->documents[s->num_documents++] = kept;
        d = xml_open(ld, kept, file, true);
    }
    fclose(file);
    return d;
}

const xmlNode *reference_follow(struct loader *ld, const xmlNode *n, const char *name,
                                const char *element)
{
    const char *url = element_needed_attribute(ld, n, name), *id = strchr(url, '#');
    if (id == NULL)
        fail_at(ld, n, "reference '%.200s' without '#'", url);
    const struct document *in = id == url    ? element_document(n)
                                : id != NULL ? open_beside(ld, n, url, (size_t)(id - url))
                                             : NULL;
    return in != NULL ? find(ld, in, n, id + 1, element) : NULL;
}
