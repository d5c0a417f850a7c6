/* From a reference to the element that it names, in this document or in a file beside it. */
#include "collada_internal.h"
#include "renderer/base/fs.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

/* The element of that id in a document. */
static bool find(struct loader *ld, const struct document *in, const xmlNode *user, const char *id,
                 const char *element, const xmlNode **out)
{
    struct id_entry key = {id, NULL};
    const struct id_entry *end = in->ids + in->num_ids,
                          *hit = in->num_ids > 0 ? bsearch(&key, in->ids, in->num_ids, sizeof key,
                                                           element_compare_ids)
                                                 : NULL;
    if (hit == NULL)
        return fail_at(ld, user, "no element with id '%.200s'", id);
    if ((hit > in->ids && element_compare_ids(hit - 1, hit) == 0) ||
        (hit + 1 < end && element_compare_ids(hit + 1, hit) == 0))
        return fail_at(ld, user, "more than one element has id '%.200s'", id);
    if (!element_is(hit->node, element))
        return fail_at(ld, user, "'%.200s' is a <%.60s>, not a <%s>", id,
                       (const char *)hit->node->name, element);
    *out = hit->node;
    return true;
}

bool reference_find(struct loader *ld, const xmlNode *n, const char *id, const char *element,
                    const xmlNode **out)
{
    return find(ld, element_document(n), n, id, element, out);
}

/* The document that the first `size` bytes of a reference name, relative to the one of n. */
static bool open_beside(struct loader *ld, const xmlNode *n, const char *reference, size_t size,
                        struct document **out)
{
    char name[PATH_MAX], resolved[PATH_MAX], other[PATH_MAX];
    if (!element_document(n)->is_file || size >= sizeof name || reference[0] == '/' ||
        memchr(reference, ':', size) != NULL)
        return fail_at(ld, n, "reference '%.200s' leads elsewhere than to a file beside this one",
                       reference);
    memcpy(name, reference, size);
    name[size] = '\0';
    text_decode_percents(name);
    struct path path = fs_beside_file(element_document(n)->path, name);
    if (realpath(path.s, resolved) == NULL)
        return fail_at(ld, n, "reference '%.200s': cannot read: %s", reference, strerror(errno));
    for (size_t i = 0; i < ld->num_documents; i++) {
        *out = ld->documents[i];
        if (realpath((*out)->path, other) != NULL && strcmp(other, resolved) == 0)
            return true;
    }
    struct text_input in = {.file = fs_open(path.s)};
    if (in.file == NULL)
        return fail_at(ld, n, "reference '%.200s': cannot read: %s", reference, strerror(errno));
    bool ok = xml_open(ld, path.s, &in, out);
    fclose(in.file);
    return ok;
}

bool reference_follow(struct loader *ld, const xmlNode *n, const char *name, const char *element,
                      const xmlNode **out)
{
    struct document *in;
    const char *url = element_attribute(n, name), *id = url != NULL ? strchr(url, '#') : NULL;
    if (url == NULL)
        return fail_at(ld, n, "<%.60s> without attribute '%s'", (const char *)n->name, name);
    if (id == url)
        return reference_find(ld, n, url + 1, element, out);
    if (id == NULL)
        return fail_at(ld, n, "reference '%.200s' without '#'", url);
    return open_beside(ld, n, url, (size_t)(id - url), &in) &&
           find(ld, in, n, id + 1, element, out);
}
