#include "reproduce_page.h"

#include "reference/base/json_file.h"
#include "renderer/base/fs.h"
#include "renderer/base/shell_quote.h"
#include "tools/results/history.h"
#include "tools/report/report.h"
#include "reproduce_internal.h"
#include "reproduce_results.h"
#include "tools/results/results.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <libxml/HTMLparser.h>

enum { MAX_PATH = RESULTS_PATH, HEAD = 1 << 20 };

static const char html_begin[] = "<!DOCTYPE html>", junit_begin[] = "<?xml ";

static bool begins(const char *path, const char *text)
{
    char head[32] = "";
    FILE *f = fopen(path, "rb");
    size_t n = f != NULL ? fread(head, 1, strlen(text), f) : 0;
    if (f != NULL)
        fclose(f);
    return n == strlen(text) && memcmp(head, text, n) == 0;
}

bool reproduce_is_page(const char *path)
{
    return begins(path, html_begin) || begins(path, junit_begin);
}

/* NULL or memory of the caller's. */
static json_t *origin_of(const xmlNode *html)
{
    static const char prefix[] = "assay:";
    json_t *origin = json_object();
    const xmlNode *head = html != NULL ? html->children : NULL;
    while (head != NULL && strcmp((const char *)head->name, "head") != 0)
        head = head->next;
    for (xmlNode *n = head != NULL ? head->children : NULL; n != NULL; n = n->next) {
        if (n->type != XML_ELEMENT_NODE || strcmp((const char *)n->name, "meta") != 0)
            continue;
        xmlChar *name = xmlGetProp(n, BAD_CAST "name"), *text = xmlGetProp(n, BAD_CAST "content");
        if (name != NULL && text != NULL &&
            strncmp((const char *)name, prefix, sizeof prefix - 1) == 0)
            json_object_set_new(origin, (const char *)name + sizeof prefix - 1,
                                json_string((const char *)text));
        xmlFree(name);
        xmlFree(text);
    }
    return origin;
}

json_t *reproduce_page_origin(const char *path, struct err *e)
{
    char *head = malloc(HEAD);
    FILE *f = fopen(path, "rb");
    json_t *origin = NULL;
    if (head == NULL || f == NULL) {
        err_set(e, "%s: %s", path, head == NULL ? "out of memory" : "cannot read");
    } else {
        size_t n = fread(head, 1, HEAD - 1, f);
        head[n] = '\0';
        const char *style = strstr(head, "<style>");
        if (style != NULL)
            n = (size_t)(style - head);
        xmlDoc *doc = htmlReadMemory(head, (int)n, NULL, "UTF-8",
                                     HTML_PARSE_NOERROR | HTML_PARSE_NOWARNING | HTML_PARSE_NONET);
        origin = origin_of(doc != NULL ? xmlDocGetRootElement(doc) : NULL);
        xmlFreeDoc(doc);
        if (origin == NULL || json_object_get(origin, "command") == NULL) {
            err_set(e, "%s: does not say by what command it was made", path);
            json_decref(origin);
            origin = NULL;
        }
    }
    if (f != NULL)
        fclose(f);
    free(head);
    return origin;
}

static bool of_results(const char *path, const json_t *origin, const char *to,
                       struct reproduced *out, struct err *e)
{
    char results[MAX_PATH];
    const char *converge = member_text(origin, "converge");
    fs_beside_file(path, "results.json", results, sizeof results);
    if (access(results, R_OK) != 0)
        return err_set(e, "%s: the results that it shows are not beside it: %s", path, results);
    if (converge != NULL && access(converge, R_OK) != 0)
        return err_set(e, "%s: '%s', which it shows too, is not here: go where it was made", path,
                       converge);
    const char *const word[] = {"assay",  "report", results, converge != NULL ? "--converge" : NULL,
                                converge, NULL};
    return reproduced_command(out, word, e) && report_write_with(results, converge, to, e);
}

static bool of_directory(const char *path, const char *to, struct reproduced *out, struct err *e)
{
    char dir[MAX_PATH];
    struct history h;
    fs_beside_file(path, ".", dir, sizeof dir);
    const char *const word[] = {"assay", "report", "--history", dir, NULL};
    if (!reproduced_command(out, word, e) || !history_read(dir, history_alpha, &h, e))
        return false;
    bool ok = report_history(&h, to, e);
    history_free(&h);
    return ok;
}

/* Compared again; the facts of that run are those of then. */
static bool of_command(const char *path, const json_t *origin, int num, char **word,
                       const char *dir, const char *to, struct reproduced *out, struct err *e)
{
    char json[MAX_PATH];
    json_error_t je;
    if (!results_run_again(path, origin, num, word, dir, json, out, e))
        return false;
    json_t *now = json_load_file(json, 0, &je);
    if (now == NULL)
        return err_set(e, "%s: made again: %s:%d: %s", path, json, je.line, je.text);
    for (int i = 0; report_origin[i] != NULL; i++)
        if (json_object_get(now, report_origin[i]) != NULL)
            json_object_set(now, report_origin[i], json_object_get(origin, report_origin[i]));
    bool ok = json_write(json, now, e) && report_write(json, to, e);
    json_decref(now);
    return ok;
}

static bool of_page(const char *path, const char *dir, const char *to, struct reproduced *out,
                    struct err *e)
{
    int num = 0;
    json_t *origin = reproduce_page_origin(path, e);
    if (origin == NULL)
        return false;
    const char *version = member_text(origin, "version");
    snprintf(out->made_by, sizeof out->made_by, "%s", version != NULL ? version : "");
    char **word = shell_quote_split(member_text(origin, "command"), &num, e);
    bool ok = word != NULL || err_prefix(e, "%s", path);
    if (ok && (num < 2 || strcmp(fs_base(word[0]), "assay") != 0))
        ok = err_set(e, "%s: made by no command of assay", path);
    if (ok && num > 2 && strcmp(word[1], "report") == 0 && strcmp(word[2], "--history") == 0)
        ok = of_directory(path, to, out, e);
    else if (ok && strcmp(word[1], "compare") == 0)
        ok = of_command(path, origin, num, word, dir, to, out, e);
    else if (ok)
        ok = of_results(path, origin, to, out, e);
    free(word);
    json_decref(origin);
    return ok;
}

static bool of_junit(const char *path, const char *to, struct reproduced *out, struct err *e)
{
    char results[MAX_PATH];
    json_t *root;
    fs_beside_file(path, "results.json", results, sizeof results);
    if (access(results, R_OK) != 0)
        return err_set(e, "%s: the results that it lists are not beside it: %s", path, results);
    const char *const word[] = {"assay", "validate,", "of", results, NULL};
    if (!reproduced_command(out, word, e) || !results_read(results, &root, e))
        return false;
    bool ok = junit_write(to, root, e);
    json_decref(root);
    return ok;
}

bool reproduce_page(const char *path, const struct reproduce_options *opt, const char *dir,
                    struct reproduced *out, struct err *e)
{
    char to[MAX_PATH];
    if (strlen(path) >= 4000)
        return err_set(e, "%.64s...: path too long", path);
    bool is_junit = begins(path, junit_begin);
    snprintf(to, sizeof to, "%.4000s/%s", dir, is_junit ? "again.xml" : "again.html");
    return (is_junit ? of_junit(path, to, out, e) : of_page(path, dir, to, out, e)) &&
           reproduce_bytes(path, to, out, e) && reproduce_keep(to, opt, e);
}
