/* From text to a document that is safe to read. */
#include "collada_internal.h"

#include <errno.h>
#include <libxml/SAX2.h>
#include <libxml/parser.h>
#include <libxml/parserInternals.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Parsing. The context's _private is the loader while it runs. */

static void element_start(void *ctx, const xmlChar *name, const xmlChar *prefix, const xmlChar *uri,
                          int num_namespaces, const xmlChar **namespaces, int num_attributes,
                          int num_defaulted, const xmlChar **attributes)
{
    xmlParserCtxt *ctxt = ctx;
    xmlNode *before = ctxt->node;
    xmlSAX2StartElementNs(ctx, name, prefix, uri, num_namespaces, namespaces, num_attributes,
                          num_defaulted, attributes);
    if (ctxt->node != NULL && ctxt->node != before)
        /* NOLINTNEXTLINE(performance-no-int-to-ptr): a number is what the field is for here. */
        ctxt->node->_private = (void *)(intptr_t)ctxt->input->line;
}

#if LIBXML_VERSION >= 21200
typedef const xmlError *xml_complaint;
#else
typedef xmlError *xml_complaint;
#endif

/* Only the first complaint is kept: those after it are mostly its consequences. */
static void complain(struct loader *ld, xml_complaint error)
{
    if (error->level < XML_ERR_ERROR || ld->parse_failed)
        return;
    ld->parse_failed = true;
    if (error->code == XML_ERR_NO_MEMORY) {
        fail_memory(ld);
        return;
    }
    char text[512];
    snprintf(text, sizeof text, "%s", error->message != NULL ? error->message : "malformed XML");
    text[strcspn(text, "\n")] = '\0';
    fail_line(ld, NULL, error->line, "not well-formed: %s", text);
}

static void parse_error(void *ctx, xml_complaint error)
{
    xmlParserCtxt *ctxt = ctx;
    complain(ctxt->_private, error);
}

/* What the library says without saying of which parser, that memory is out above all: it goes on then, and may leave
 * something out of the tree. Without this it would print it, too. */
static void library_error(void *ld, xml_complaint error)
{
    complain(ld, error);
}

/* Without document types there are no entities to expand, so no entity bombs and no outside files.
 */
static void document_type(void *ctx, const xmlChar *name, const xmlChar *external,
                          const xmlChar *system)
{
    (void)name;
    (void)external;
    (void)system;
    xmlParserCtxt *ctxt = ctx;
    struct loader *ld = ctxt->_private;
    if (!ld->parse_failed)
        fail_line(ld, NULL, ctxt->input->line, "a document type (DOCTYPE) is not accepted");
    ld->parse_failed = true;
    xmlStopParser(ctxt);
}

struct reading {
    struct loader *ld;
    struct text_input *in;
};

/* libxml2 asks for a few thousand bytes at a time, so the text is never in memory as a whole. */
static int read_some(void *context, char *buffer, int size)
{
    const struct reading *r = context;
    struct text_input *in = r->in;
    size_t n = (size_t)size;
    if (in->file != NULL) {
        n = fread(buffer, 1, n, in->file);
        if (ferror(in->file))
            in->failed = !err_set(r->ld->err, "%s: cannot read: %s", r->ld->path, strerror(errno));
    } else {
        n = n < in->size - in->taken ? n : in->size - in->taken;
        memcpy(buffer, in->text + in->taken, n);
    }
    in->taken += n;
    if (in->taken > MAX_FILE_BYTES)
        in->failed = !err_set(r->ld->err, "%s: larger than %d bytes", r->ld->path, MAX_FILE_BYTES);
    r->ld->parse_failed |= in->failed; /* what the parser says of it is of no interest */
    return in->failed ? -1 : (int)n;
}

static bool parse(struct loader *ld, struct document *d, struct text_input *in)
{
    struct reading reading = {ld, in};
    xmlSetStructuredErrorFunc(ld, library_error); /* of this thread */
    xmlParserCtxt *ctxt = xmlNewParserCtxt();
    if (ctxt == NULL) {
        xmlSetStructuredErrorFunc(NULL, NULL);
        return fail_memory(ld);
    }
    ctxt->_private = ld;
    ctxt->sax->startElementNs = element_start;
    ctxt->sax->internalSubset = document_type;
    ctxt->sax->serror = parse_error;
    /* HUGE lifts the limit of 10 MB for one text, which large meshes reach; what else it lifts
     * (depth, entities) is checked here. */
    d->doc = xmlCtxtReadIO(ctxt, read_some, NULL, &reading, NULL, NULL,
                           XML_PARSE_NONET | XML_PARSE_HUGE);
    if (ctxt->errNo == XML_ERR_NO_MEMORY && !ld->parse_failed)
        ld->parse_failed = !fail_memory(ld);
    bool failed = ld->parse_failed;
    xmlFreeParserCtxt(ctxt);
    xmlSetStructuredErrorFunc(NULL, NULL);
    if (failed)
        return false;
    if (d->doc == NULL || xmlDocGetRootElement(d->doc) == NULL)
        return fail_line(ld, NULL, 1, "not well-formed: no XML document");
    return true;
}

/* The survey of the whole document: ids, dialect, and what may not be anywhere. */

static bool is_blank_text(const xmlNode *n)
{
    return n->content == NULL || n->content[strspn((const char *)n->content, " \t\r\n")] == '\0';
}

static bool survey_texts(struct loader *ld, const xmlNode *n)
{
    bool has_elements = element_first_child(n) != NULL;
    for (const xmlNode *c = n->children; c != NULL; c = c->next) {
        bool is_text = c->type == XML_TEXT_NODE || c->type == XML_CDATA_SECTION_NODE;
        if (has_elements && is_text && !is_blank_text(c))
            return fail_at(ld, n, "stray text between the elements of <%.60s>",
                           (const char *)n->name);
    }
    return true;
}

/* *enter: whether what is inside is for us to read. */
static bool survey_element(struct loader *ld, xmlNode *n, bool *has_cgl, bool *enter)
{
    *enter = true;
    /* Other files may have textures for our meshes. */
    const char *url = element_attribute(n, "url"), *target = element_attribute(n, "target");
    if (ld->num_documents == 1)
        ld->has_textures |= element_is(n, "texture") || (url != NULL && url[0] != '#') ||
                            (target != NULL && target[0] != '#');
    if (element_is(n, "technique")) {
        const char *profile = element_attribute(n, "profile");
        const xmlNode *owner = n->parent->parent;
        if (profile != NULL && strcmp(profile, "CMU462") == 0)
            return fail_at(ld, n, "profile 'CMU462' is not supported");
        if (element_is_own_profile(profile) &&
            !(element_is(n->parent, "extra") && owner->type == XML_ELEMENT_NODE &&
              element_is_one_of(owner, "geometry light effect")))
            return fail_at(ld, n,
                           "profile '%s' has no meaning here: only in the <extra> of a "
                           "geometry, light or effect",
                           profile);
        if (profile != NULL && strcmp(profile, "CGL") == 0) {
            if (ld->dialect == DIALECT_COLLADA)
                return fail_at(ld, n, "profile 'CGL' needs --dialect cgl");
            *has_cgl = true;
        }
        *enter = profile == NULL || element_is_own_profile(profile);
    } else if (strncmp((const char *)n->name, "profile_", 8) == 0 &&
               !element_is(n, "profile_COMMON")) {
        *enter = false;
    }
    return !*enter || survey_texts(ld, n);
}

static bool add_id(struct loader *ld, struct document *d, xmlNode *n, size_t *capacity)
{
    const char *id = element_attribute(n, "id");
    if (id == NULL)
        return true;
    struct id_entry *grown = build_grow(ld, d->ids, sizeof *grown, d->num_ids, capacity);
    if (grown == NULL)
        return false;
    d->ids = grown;
    d->ids[d->num_ids++] = (struct id_entry){id, n};
    return true;
}

static bool survey(struct loader *ld, struct document *d, bool *has_cgl)
{
    xmlNode *root = xmlDocGetRootElement(d->doc), *n = root;
    size_t capacity = 0;
    int depth = 0;
    while (n != NULL) {
        bool enter;
        if (depth > MAX_XML_DEPTH)
            return fail_at(ld, n, "elements nested deeper than %d", MAX_XML_DEPTH);
        if (!survey_element(ld, n, has_cgl, &enter) || !add_id(ld, d, n, &capacity))
            return false;
        xmlNode *next = enter ? element_first_child(n) : NULL;
        if (next != NULL)
            depth++;
        while (next == NULL && n != root) {
            next = element_next_sibling(n);
            if (next == NULL) {
                n = n->parent;
                depth--;
            }
        }
        n = next;
    }
    if (d->num_ids > 0)
        qsort(d->ids, d->num_ids, sizeof *d->ids, element_compare_ids);
    return true;
}

static bool check_root(struct loader *ld, const xmlNode *root)
{
    static const char *const NAMESPACES[] = {"http://www.collada.org/2005/11/COLLADASchema",
                                             "http://www.collada.org/2008/03/COLLADASchema"};
    if (strcmp((const char *)root->name, "COLLADA") != 0)
        return fail_at(ld, root, "the root is <%.60s>, not <COLLADA>", (const char *)root->name);
    if (root->ns != NULL && strcmp((const char *)root->ns->href, NAMESPACES[0]) != 0 &&
        strcmp((const char *)root->ns->href, NAMESPACES[1]) != 0)
        return fail_at(ld, root, "unknown COLLADA namespace '%.200s'",
                       (const char *)root->ns->href);
    const char *version = element_attribute(root, "version");
    if (version == NULL || (strncmp(version, "1.4", 3) != 0 && strncmp(version, "1.5", 3) != 0))
        return fail_at(ld, root, "COLLADA version '%.60s' is not supported: only 1.4 and 1.5 are",
                       version != NULL ? version : "(none)");
    return true;
}

/* 0 for another program. */
static double blender_version(const xmlNode *root)
{
    const xmlNode *asset = element_child_named(root, "asset"),
                  *by = asset != NULL ? element_child_named(asset, "contributor") : NULL,
                  *tool = by != NULL ? element_child_named(by, "authoring_tool") : NULL;
    const xmlNode *text = tool != NULL ? tool->children : NULL;
    bool is_blender = text != NULL && text->content != NULL &&
                      strncmp((const char *)text->content, "Blender ", 8) == 0;
    return is_blender ? strtod((const char *)text->content + 8, NULL) : 0;
}

bool xml_open(struct loader *ld, const char *path, struct text_input *in, struct document **out)
{
    const char *main_path = ld->path;
    bool has_cgl = false;
    struct document *d = calloc(1, sizeof *d), **grown = NULL;
    if (d != NULL)
        grown =
            build_grow(ld, ld->documents, sizeof(void *), ld->num_documents, &ld->cap_documents);
    if (grown == NULL) {
        free(d);
        return fail_memory(ld);
    }
    ld->documents = grown;
    ld->documents[ld->num_documents++] = *out = d;
    d->path = strdup(path);
    if (d->path == NULL)
        return fail_memory(ld);
    d->is_file = in->file != NULL;
    ld->path = d->path;
    if (!parse(ld, d, in))
        return false;
    ld->path = main_path;
    d->doc->_private = d;
    const xmlNode *root = xmlDocGetRootElement(d->doc);
    if (!check_root(ld, root) || !survey(ld, d, &has_cgl))
        return false;
    if (ld->num_documents == 1)
        ld->blender_version = blender_version(root);
    if (ld->dialect == DIALECT_AUTO) {
        /* The course's scenes without CGL extras (meshedit, keenan, simple) are as these wrote them, which no
         * other program of these days does. */
        ld->is_course_export =
            !has_cgl && (ld->blender_version == 2.72 || ld->blender_version == 2.74);
        ld->dialect = has_cgl || ld->is_course_export ? DIALECT_CGL : DIALECT_COLLADA;
    }
    return true;
}
