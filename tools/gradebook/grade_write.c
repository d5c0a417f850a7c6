/* Writes the grades of a submission and of a class: JSON, CSV, JUnit, Gradescope's results.json,
 * and the pages. */
#include "grade_batch.h"
#include "grade_needs.h"

#include "reference/base/json_file.h"
#include "reference/base/utc_date.h"
#include "renderer/base/fs.h"
#include "student_page.h"
#include "tools/base/text.h"
#include "tools/html/html.h"
#include "tools/results/results.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* To a hundredth of a point: more would be noise. */
static double rounded(double points)
{
    return round(100 * points) / 100;
}

static bool is_judged(const json_t *check)
{
    return json_is_true(json_object_get(check, "judged"));
}

/* What a student reads of a check. */
static void describe(const json_t *c, char *out, size_t size)
{
    const char *appeal = member_or_empty(c, "appeal"), *accepted = member_or_empty(c, "accepted"),
               *hint = member_or_empty(c, "hint"), *where = member_or_empty(c, "where"),
               *carried = member_or_empty(c, "carried");
    out[0] = '\0';
    if (grade_is_provisional(c))
        text_append(
            out, size,
            "Provisional: the samples did not suffice to decide this; the points are kept until staff have looked.\n");
    else if (!grade_is_full(c) && member_number(c, "share") > 0)
        text_append(out, size, "Partial credit: %.2f of %g points.\n", member_number(c, "points"),
                    member_number(c, "of"));
    text_append(out, size, "Expected: %s.\nSeen: %s.", member_or_empty(c, "expected"),
                member_or_empty(c, "seen"));
    if (carried[0] != '\0')
        text_append(out, size, "\nPaid once: %s", carried);
    if (appeal[0] != '\0')
        text_append(out, size, "\nDecided by staff: %s", appeal);
    if (accepted[0] != '\0')
        text_append(out, size,
                    "\nExplained by what you were given, no points lost for it: %s.",
                    accepted);
    if (!grade_is_full(c) && hint[0] != '\0')
        text_append(out, size, "\nHint: %s", hint);
    if (!grade_is_full(c) && where[0] != '\0')
        text_append(out, size, "\nWhere: %s", where);
    if (!is_judged(c))
        text_append(out, size, "\nNot judged: staff have to look at this.");
}

/* What is said of the submission as a whole, which the student reads at once: the bug's name with its place above
 * all. */
static void describe_whole(const json_t *grade, char *out, size_t size)
{
    const json_t *diagnosis = json_object_get(grade, "diagnosis");
    const char *located = member_or_empty(grade, "located");
    size_t i;
    json_t *b;
    const char *why[2] = {member_or_empty(grade, "trouble"), member_or_empty(grade, "wrong")};
    out[0] = '\0';
    for (int k = 0; k < 2; k++)
        text_append(out, size, "%s%s", why[k], why[k][0] != '\0' ? "\n" : "");
    if (grade_is_provisional(grade))
        text_append(out, size, "Some points are provisional, until staff have looked.\n");
    if (located[0] != '\0')
        text_append(out, size, "What is wrong shows %s.\n", located);
    else if (strcmp(member_or_empty(diagnosis, "finding"), "unknown") == 0 && grade_differs(grade))
        text_append(out, size,
                    "Different from the right images in a way that no known bug explains.");
    json_array_foreach(json_object_get(diagnosis, "named"), i, b) {
        const char *and = member_or_empty(b, "and_bug");
        text_append(out, size, "%s%s (%s)",
                    i == 0 ? "This looks like: " : "\nor: ", member_or_empty(b, "bug"),
                    member_or_empty(b, "where"));
        if (and[0] != '\0')
            text_append(out, size, ", and with it %s (%s)", and, member_or_empty(b, "and_where"));
    }
    json_each(part, json_object_get(diagnosis, "parts")) {
        text_append(out, size, "%sPart %s by itself looks like: ",
                    out[0] != '\0' && out[strlen(out) - 1] != '\n' ? "\n" : "",
                    member_or_empty(part, "part"));
        json_array_foreach(json_object_get(part, "named"), i, b)
            text_append(out, size, "%s%s (%s)", i > 0 ? ", or " : "", member_or_empty(b, "bug"),
                        member_or_empty(b, "where"));
    }
}

/* Wall time of the first run of each image, summed. */
static double execution_time(const json_t *grade)
{
    double sum = 0;
    json_each(p, json_object_get(grade, "pictures"))
        sum += member_number(p, "wall_s");
    return sum;
}

/* Fields as documented at gradescope-autograders.readthedocs.io, "specs": points and texts of every check, no
 * score of the whole, which Gradescope adds up. */
static json_t *gradescope(const json_t *grade, const json_t *view)
{
    json_t *tests = json_array();
    size_t i, shown = 0;
    json_t *c;
    json_array_foreach(json_object_get(grade, "checks"), i, c) {
        char output[4096], name[400], number[32];
        describe(student_view_shows(c) ? json_array_get(json_object_get(view, "checks"), shown++)
                                       : c,
                 output, sizeof output);
        snprintf(name, sizeof name, "Part %s: %s", member_or_empty(c, "part"),
                 member_or_empty(c, "title"));
        snprintf(number, sizeof number, "%s.%zu", member_or_empty(c, "part"), i + 1);
        json_array_append_new(tests, json_pack("{sf, sf, ss, ss, ss, ss, ss}", "score",
                                               rounded(member_number(c, "points")), "max_score",
                                               member_number(c, "of"), "name", name, "number",
                                               number, "output", output, "visibility",
                                               member_or_empty(c, "visibility"), "status",
                                               grade_is_full(c) ? "passed" : "failed"));
    }
    char whole[2048];
    describe_whole(view, whole, sizeof whole);
    bool any = json_array_size(tests) > 0;
    json_t *root =
        json_pack("{so*, sf, ss, ss, ss, ss}", "output", json_string(whole), "execution_time",
                  execution_time(grade), "output_format", "text", "test_output_format", "text",
                  "visibility", "visible", "stdout_visibility", "hidden");
    json_object_set_new(root, any ? "tests" : "score", any ? json_incref(tests) : json_real(0));
    json_decref(tests);
    return root;
}

/* RFC 4180; a leading = + - @ would be a formula to a spreadsheet. */
static void csv_text(FILE *f, const char *text)
{
    fputc('"', f);
    if (text[0] != '\0' && strchr("=+-@\t", text[0]) != NULL)
        fputc('\'', f);
    for (; *text != '\0'; text++) {
        if (*text == '"')
            fputc('"', f);
        fputc(*text == '\n' || *text == '\r' ? ' ' : *text, f);
    }
    fputc('"', f);
}

/* What a list of points cannot show: why there are none, what is wrong, and which points staff gave. */
static void remark_of(const json_t *grade, char *out, size_t size)
{
    snprintf(out, size, "%s",
             member_or_empty(grade, member_text(grade, "trouble") != NULL ? "trouble"
                                    : member_text(grade, "wrong") != NULL ? "wrong"
                                                                          : "flag"));
    json_each(c, json_object_get(grade, "checks"))
        if (member_text(c, "appeal") != NULL)
            text_append(out, size, "%s%s by appeal", out[0] != '\0' ? "; " : "",
                        member_or_empty(c, "name"));
}

static void write_csv(FILE *f, const json_t *grades)
{
    const json_t *first = NULL;
    json_each(g, grades)
        if (first == NULL && json_array_size(json_object_get(g, "checks")) > 0)
            first = g;
    fputs("id,points,of,remarks", f);
    json_each(c, json_object_get(first, "checks")) {
        fputc(',', f);
        csv_text(f, member_or_empty(c, "name"));
    }
    fputs("\r\n", f);
    json_each(g, grades) {
        char remark[1024];
        csv_text(f, member_or_empty(g, "id"));
        fprintf(f, ",%.2f,%g,", member_number(g, "points"), member_number(g, "of"));
        remark_of(g, remark, sizeof remark);
        csv_text(f, remark);
        json_each(c, json_object_get(g, "checks"))
            fprintf(f, ",%.2f", member_number(c, "points"));
        fputs("\r\n", f);
    }
}

static void xml_pair(FILE *f, const char *name, const char *value)
{
    fprintf(f, " %s=\"", name);
    html_text(f, value);
    fputc('"', f);
}

/* As Ant's schema has it, the strictest in use. */
static void write_junit(FILE *f, const json_t *grades)
{
    size_t i;
    json_t *g;
    char date[20]; /* without a zone */
    snprintf(date, sizeof date, "%.19s", utc_date_now().s);
    fputs("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n", f);
    json_array_foreach(grades, i, g) {
        size_t failures = 0, errors = member_or_empty(g, "trouble")[0] != '\0',
               checks = json_array_size(json_object_get(g, "checks"));
        json_each(c, json_object_get(g, "checks")) {
            failures += is_judged(c) && !grade_is_full(c);
            errors += !is_judged(c);
        }
        fputs("<testsuite", f);
        xml_pair(f, "name", member_or_empty(g, "id"));
        fprintf(
            f,
            " tests=\"%zu\" failures=\"%zu\" errors=\"%zu\" time=\"%.2f\" id=\"%zu\" package=\"grades\" hostname=\"localhost\" timestamp=\"%s\">\n<properties/>\n",
            checks + (checks == 0), failures, errors, member_number(g, "cpu_s"), i, date);
        if (checks == 0) {
            fputs(
                "<testcase classname=\"all\" name=\"submission\" time=\"0\"><error type=\"not graded\"",
                f);
            xml_pair(f, "message", member_or_empty(g, "trouble"));
            fputs("/></testcase>\n", f);
        }
        json_each(c, json_object_get(g, "checks")) {
            char output[4096];
            describe(c, output, sizeof output);
            fputs("<testcase", f);
            xml_pair(f, "classname", member_or_empty(c, "part"));
            xml_pair(f, "name", member_or_empty(c, "name"));
            fputs(" time=\"0\">", f);
            if (!grade_is_full(c)) {
                fputs(is_judged(c) ? "<failure type=\"points\"" : "<error type=\"not judged\"", f);
                xml_pair(f, "message", member_or_empty(c, "seen"));
                fputc('>', f);
                html_text(f, output);
                fputs(is_judged(c) ? "</failure>" : "</error>", f);
            }
            fputs("</testcase>\n", f);
        }
        fputs("<system-out/>\n<system-err/>\n</testsuite>\n", f);
    }
    fputs("</testsuites>\n", f);
}

static bool write_json(const char *path, json_t *root, struct err *e)
{
    bool ok = json_write(path, root, e);
    json_decref(root);
    return ok;
}

/* Writes one of class_files to f. */
static bool write_text(const json_t *grades, const char *name, FILE *f, struct err *e)
{
    if (strcmp(name, "grades.csv") == 0)
        write_csv(f, grades);
    else if (strcmp(name, "junit.xml") == 0)
        write_junit(f, grades);
    else {
        assert(strcmp(name, "index.html") == 0);
        return class_page(f, grades, e);
    }
    return true;
}

static const char *const class_files[] = {"grades.csv", "junit.xml", "index.html", NULL};
static const char *const pages[] = {"index.html", "staff.html", NULL};

bool grade_writes_file(const char *name)
{
    bool found = strcmp(name, "grades.json") == 0;
    for (int k = 0; class_files[k] != NULL; k++)
        found = found || strcmp(name, class_files[k]) == 0;
    return found;
}

/* Writes one of these files. grades: the array for a file of the class, one grade for a
 * submission's page; view: what the student may see of it. */
static bool write_file(const char *out, const struct rubric *r, const struct answer_key *a,
                       const json_t *grades, const json_t *view, const char *name, struct err *e)
{
    struct out_file o;
    bool of_class = json_is_array(grades), ok;
    const struct path to = of_class ? fs_path("%s/%s", out, name)
                                    : fs_path("%s/%s/%s", out, member_or_empty(grades, "id"), name);
    if (!fs_make_parent_dirs(to.s, e) || !out_open(&o, to.s, e))
        return false;
    if (of_class)
        ok = write_text(grades, name, o.f, e);
    else if (strcmp(name, "staff.html") == 0)
        ok = student_page_for_staff(o.f, out, r, a, grades, e);
    else
        ok = student_page(o.f, out, view,
                          json_array_size(json_object_get(view, "checks")) <
                              json_array_size(json_object_get(grades, "checks")),
                          e);
    if (ok)
        return out_commit(&o, e);
    out_abandon(&o);
    return false;
}

bool grade_write(const char *out, const struct rubric *r, const struct answer_key *a,
                 const json_t *grades, struct err *e)
{
    bool ok = true;
    json_each(g, grades) {
        json_t *view = student_view(g);
        ok = ok && write_json(fs_path("%s/%s/results.json", out, member_or_empty(g, "id")).s,
                              gradescope(g, view), e);
        for (int k = 0; ok && pages[k] != NULL; k++)
            ok = write_file(out, r, a, g, view, pages[k], e);
        json_decref(view);
    }
    ok = ok && json_write(fs_path("%s/grades.json", out).s, grades, e);
    for (int k = 0; ok && class_files[k] != NULL; k++)
        ok = write_file(out, r, a, grades, NULL, class_files[k], e);
    return ok;
}
