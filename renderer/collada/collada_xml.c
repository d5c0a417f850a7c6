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

/* Receives the errors of the parser, and those that the library reports without naming a parser, above all lack of
 * memory: it then goes on and may leave something out of the tree. Without this handler it would also print them. */
static void complain(void *ctx, xml_complaint error)
{
    const xmlParserCtxt *ctxt = ctx; /* NULL while there is none */
    const char *text = error->message != NULL ? error->message : "malformed XML";
    if (ctxt == NULL || error->level < XML_ERR_ERROR)
        return;
    if (error->code == XML_ERR_NO_MEMORY)
        element_fail_memory(ctxt->_private);
    element_fail_line(ctxt->_private, NULL, error->line, "not well-formed: %.*s",
                      (int)strcspn(text, "\n"), text);
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
    element_fail_line(ctxt->_private, NULL, ctxt->input->line,
                      "a document type (DOCTYPE) is not accepted");
    xmlStopParser(ctxt);
}

/* Replaces a comment by a blank and its line ends, so that texts are not split and their line numbers stay right. */
static void comment(void *ctx, const xmlChar *text)
{
    xmlSAX2Characters(ctx, BAD_CAST " ", 1);
    for (const xmlChar *c = text; *c != '\0'; c++)
        if (*c == '\n')
            xmlSAX2Characters(ctx, c, 1);
}

/* libxml2 asks for a few thousand bytes at a time, so the text is never in memory as a whole. */
static int read_some(void *context, char *buffer, int size)
{
    struct loader *ld = context;
    size_t n = fread(buffer, 1, (size_t)size, ld->file);
    if (ferror(ld->file))
        element_fail_line(ld, NULL, 0, "cannot read: %s", strerror(errno));
    if (ftell(ld->file) > MAX_FILE_BYTES)
        element_fail_line(ld, NULL, 0, "larger than %d bytes", MAX_FILE_BYTES);
    return ld->failed ? -1 : (int)n;
}

static bool parse(struct loader *ld, struct document *d)
{
    xmlSetStructuredErrorFunc(NULL, complain); /* of this thread */
    xmlParserCtxt *ctxt = xmlNewParserCtxt();
    if (ctxt != NULL) {
        xmlSetStructuredErrorFunc(ctxt, complain);
        ctxt->_private = ld;
        ctxt->sax->serror = complain;
        ctxt->sax->startElementNs = element_start;
        ctxt->sax->internalSubset = document_type;
        ctxt->sax->comment = comment;
        ctxt->sax->processingInstruction = NULL;
        ctxt->sax->cdataBlock = xmlSAX2Characters;
        /* HUGE lifts the limit of 10 MB for one text, which large meshes reach; the other limits that
         * it lifts (depth, entities) are checked in this file. */
        d->doc =
            xmlCtxtReadIO(ctxt, read_some, NULL, ld, NULL, NULL, XML_PARSE_NONET | XML_PARSE_HUGE);
    }
    if (ctxt == NULL || ctxt->errNo == XML_ERR_NO_MEMORY)
        element_fail_memory(ld);
    xmlFreeParserCtxt(ctxt);
    xmlSetStructuredErrorFunc(NULL, NULL);
    return (d->doc != NULL && xmlDocGetRootElement(d->doc) != NULL && !ld->failed) ||
           element_fail_line(ld, NULL, 1, "not well-formed: no XML document");
}

/* The survey of the whole document: ids, dialect, and what is not allowed anywhere. */

static void survey_texts(struct loader *ld, const xmlNode *n)
{
    if (element_first(n) == NULL)
        return;
    for (const xmlNode *c = n->children; c != NULL; c = c->next)
        if (c->type == XML_TEXT_NODE && c->content[strspn((char *)c->content, " \t\r\n")] != '\0')
            fail_at(ld, n, "stray text between the elements of <%.60s>", (const char *)n->name);
}

/* Checks one element. Returns whether its children are for us to read. */
static bool survey_element(struct loader *ld, const xmlNode *n, bool *has_cgl)
{
    /* Files that this one refers to may have textures for its meshes. */
    const char *url = element_attribute(n, "url"), *target = element_attribute(n, "target");
    if (ld->num_documents == 1)
        ld->has_textures |= element_is(n, "texture") || (url != NULL && url[0] != '#') ||
                            (target != NULL && target[0] != '#');
    if (element_is(n, "asset") && element_first(n->parent) != n)
        fail_at(ld, n, "<asset> is not the first in <%.60s>", (const char *)n->parent->name);
    if (!element_is(n, "technique"))
        return strncmp((const char *)n->name, "profile_", 8) != 0 ||
               element_is(n, "profile_COMMON");
    const char *profile = element_attribute(n, "profile");
    const xmlNode *owner = n->parent->parent;
    bool is_cgl = profile != NULL && strcmp(profile, "CGL") == 0;
    if (profile != NULL && strcmp(profile, "CMU462") == 0)
        fail_at(ld, n, "profile 'CMU462' is not supported");
    if (element_is_own_profile(profile) &&
        !(element_is(n->parent, "extra") && owner->type == XML_ELEMENT_NODE &&
          element_is_one_of(owner, "geometry light effect")))
        fail_at(ld, n,
                "profile '%s' has no meaning here: only in the <extra> of a geometry, light or "
                "effect",
                profile);
    if (is_cgl && ld->dialect == DIALECT_COLLADA)
        fail_at(ld, n, "profile 'CGL' needs --dialect cgl");
    *has_cgl |= is_cgl;
    return profile == NULL || element_is_own_profile(profile);
}

static void add_id(struct loader *ld, struct document *d, const xmlNode *n)
{
    const xmlChar *id = BAD_CAST element_attribute(n, "id");
    if (id == NULL)
        return;
    bool is_first = xmlHashLookup(d->ids, id) == NULL;
    if ((is_first ? xmlHashAddEntry(d->ids, id, (xmlNode *)n)
                  : xmlHashUpdateEntry(d->ids, id, d, NULL)) != 0)
        element_fail_memory(ld);
}

static void survey(struct loader *ld, struct document *d, const xmlNode *n, int depth,
                   bool *has_cgl)
{
    if (depth > MAX_XML_DEPTH)
        fail_at(ld, n, "elements nested deeper than %d", MAX_XML_DEPTH);
    add_id(ld, d, n);
    if (!survey_element(ld, n, has_cgl))
        return;
    survey_texts(ld, n);
    for (const xmlNode *c = element_first(n); c != NULL && !ld->failed; c = element_next(c))
        survey(ld, d, c, depth + 1, has_cgl);
}

static bool check_root(struct loader *ld, const xmlNode *root)
{
    static const char SCHEMAS[] = "http://www.collada.org/2005/11/COLLADASchema "
                                  "http://www.collada.org/2008/03/COLLADASchema";
    const char *version = element_attribute(root, "version");
    if (strcmp((const char *)root->name, "COLLADA") != 0)
        fail_at(ld, root, "the root is <%.60s>, not <COLLADA>", (const char *)root->name);
    if (root->ns != NULL && element_place_among((const char *)root->ns->href, SCHEMAS) < 0)
        fail_at(ld, root, "unknown COLLADA namespace '%.200s'", (const char *)root->ns->href);
    if (version == NULL || (strncmp(version, "1.4", 3) != 0 && strncmp(version, "1.5", 3) != 0))
        fail_at(ld, root, "COLLADA version '%.60s' is not supported: only 1.4 and 1.5 are",
                version != NULL ? version : "(none)");
    return !ld->failed;
}

/* Version of the Blender that wrote the file; 0 for another program. */
static double blender_version(const xmlNode *root)
{
    const xmlNode *by = element_child(element_child(root, "asset"), "contributor"),
                  *tool = element_child(by, "authoring_tool"),
                  *text = tool != NULL ? tool->children : NULL;
    bool is_blender = text != NULL && text->content != NULL &&
                      strncmp((const char *)text->content, "Blender ", 8) == 0;
    return is_blender ? strtod((const char *)text->content + 8, NULL) : 0;
}

const struct document *xml_open(struct loader *ld, const char *path, FILE *file, bool is_file)
{
    const char *main_path = ld->path;
    bool has_cgl = false;
    struct document *d = calloc(1, sizeof *d);
    ld->documents = build_grow(ld, ld->documents, sizeof(void *), ld->num_documents);
    if (ld->failed || d == NULL) {
        free(d);
        element_fail_memory(ld);
        return NULL;
    }
    ld->documents[ld->num_documents++] = d;
    d->is_file = is_file;
    d->path = ld->path = path;
    ld->file = file;
    bool parsed = parse(ld, d);
    ld->path = main_path;
    if (!parsed)
        return NULL;
    d->doc->_private = d;
    d->ids = xmlHashCreateDict(0, d->doc->dict);
    if (d->ids == NULL)
        element_fail_memory(ld);
    const xmlNode *root = xmlDocGetRootElement(d->doc);
    if (!check_root(ld, root))
        return NULL;
    survey(ld, d, root, 0, &has_cgl);
    if (ld->num_documents == 1)
        ld->blender_version = blender_version(root);
    if (ld->dialect == DIALECT_AUTO) {
        /* The course's scenes without CGL extras (meshedit, keenan, simple) were written by these versions, of
         * 2014 and 2015, which nobody exports with today. */
        ld->is_course_export =
            !has_cgl && (ld->blender_version == 2.72 || ld->blender_version == 2.74);
        ld->dialect = has_cgl || ld->is_course_export ? DIALECT_CGL : DIALECT_COLLADA;
    }
    return ld->failed ? NULL : d;
}
