/* grade_table GRADES.json PATCHES SUBMISSIONS: the outcomes of a batch whose submissions are known bugs (ID is that of a patch, or
 * A+B) or are described by SUBMISSIONS/ID.txt, as Markdown: points, in which parts they were lost, whether that of the bug is
 * among them, and what it was called. Exits 1 if a program that is described as right lost points, or any other kept
 * them all. */
#include "tools/diagnose/catalogue.h"
#include "tools/results/results.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PARTS = 16 };

struct told {
    char what[400], part[16];
    bool known, right;
};

static const char *text_of(const json_t *o, const char *key)
{
    const char *text = json_string_value(json_object_get(o, key));
    return text != NULL ? text : "";
}

/* "part 3, direct light: ..." is 3, "project 3-2, ..." 3-2. */
static void part_of(const char *where, char out[16])
{
    const char *at = strncmp(where, "part ", 5) == 0      ? where + 5
                     : strncmp(where, "project ", 8) == 0 ? where + 8
                                                          : "";
    snprintf(out, 16, "%.*s", (int)strcspn(at, ",: "), at);
}

/* The last bug of A+B is the student's own. */
static bool look_up(const char *id, const char *patches, const char *submissions, struct told *out)
{
    char path[4200], first[128] = "";
    struct bug bug;
    struct err e;
    const char *plus = strchr(id, '+');
    *out = (struct told){.known = true};
    if (plus != NULL)
        snprintf(first, sizeof first, "%.*s and ", (int)(plus - id < 100 ? plus - id : 100), id);
    snprintf(path, sizeof path, "%.3800s/%.128s.patch", patches, plus != NULL ? plus + 1 : id);
    if (catalogue_bug_of_patch(path, &bug, &e)) {
        part_of(bug.where, out->part);
        snprintf(out->what, sizeof out->what, "%s%s", first, bug.what);
        return true;
    }
    *out = (struct told){0};
    snprintf(path, sizeof path, "%.3800s/%.128s.txt", submissions, id);
    FILE *f = fopen(path, "r");
    if (f == NULL || fgets(out->what, sizeof out->what, f) == NULL) {
        fprintf(stderr, "grade_table: %s: neither a patch nor described by %s\n", id, path);
        if (f != NULL)
            fclose(f);
        return false;
    }
    fclose(f);
    out->what[strcspn(out->what, "\n")] = '\0';
    out->right = strncmp(out->what, "right: ", 7) == 0;
    if (out->right)
        memmove(out->what, out->what + 7, strlen(out->what + 7) + 1);
    return true;
}

static bool is_named(const json_t *grade, const char *id)
{
    const json_t *named = json_object_get(json_object_get(grade, "diagnosis"), "named");
    const char *plus = strchr(id, '+');
    size_t i;
    json_t *b;
    json_array_foreach(named, i, b)
    {
        if (strcmp(text_of(b, "name"), plus != NULL ? plus + 1 : id) == 0)
            return true;
    }
    return false;
}

static void print_names(const json_t *grade, const char *id, bool known)
{
    const json_t *d = json_object_get(grade, "diagnosis"), *named = json_object_get(d, "named");
    size_t i;
    json_t *b;
    if (known && is_named(grade, id))
        printf("%s", json_array_size(named) == 1 ? "itself" : "itself, or ");
    json_array_foreach(named, i, b)
    {
        const char *plus = strchr(id, '+');
        if (strcmp(text_of(b, "name"), plus != NULL ? plus + 1 : id) != 0)
            printf("%s%s", text_of(b, "name"), i + 1 < json_array_size(named) ? " " : "");
    }
    if (json_array_size(named) == 0 && json_object_get(d, "finding") != NULL)
        printf("%s", strcmp(text_of(d, "finding"), "correct") == 0 ? "not found"
                                                                   : "different, cause unknown");
}

static bool has_right_image(const json_t *grade)
{
    size_t i;
    json_t *c;
    json_array_foreach(json_object_get(grade, "checks"), i, c)
    {
        if (strcmp(text_of(c, "kind"), "equal") == 0 && member_number(c, "share") == 1)
            return true;
    }
    return false;
}

int main(int argc, char **argv)
{
    json_t *grades = argc == 4 ? json_load_file(argv[1], 0, NULL) : NULL, *g, *p;
    size_t i, k;
    int bugs = 0, lost = 0, there = 0, named = 0, names = 0, wrong = 0, bad = 0;
    double cpu_s = 0;
    if (!json_is_array(grades)) {
        fputs("usage: grade_table GRADES.json PATCHES SUBMISSIONS\n", stderr);
        return 3;
    }
    const json_t *parts = json_object_get(json_array_get(grades, 0), "parts");
    fputs("| submission | what it is | points |", stdout);
    json_array_foreach(parts, k, p) printf(" %s |", text_of(p, "number"));
    fputs(" in its part | accepted | named |\n|---|---|--:|", stdout);
    json_array_foreach(parts, k, p) fputs("--:|", stdout);
    fputs("---|---|---|\n", stdout);
    json_array_foreach(grades, i, g)
    {
        struct told o;
        const char *id = text_of(g, "id");
        bool less = member_number(g, "points") < member_number(g, "of") - 1e-9, in_part = false;
        if (!look_up(id, argv[2], argv[3], &o))
            return 3;
        printf("| %s | %s | %.4g |", id, o.what, member_number(g, "points"));
        json_array_foreach(json_object_get(g, "parts"), k, p)
        {
            double points = member_number(p, "points"), of = member_number(p, "of");
            bool lost_here = points < of - 1e-9;
            in_part |= lost_here && strcmp(text_of(p, "number"), o.part) == 0;
            printf(lost_here ? " **%.3g** |" : " %.3g |", points);
        }
        printf(" %s | %s | ", !o.known ? "" : in_part ? "yes" : "no", text_of(g, "accepted"));
        print_names(g, id, o.known);
        puts(" |");
        bool accepted = o.known && !less && text_of(g, "accepted")[0] != '\0';
        cpu_s += member_number(g, "cpu_s");
        bugs += o.known && !accepted;
        lost += o.known && less;
        there += o.known && in_part;
        named += o.known && is_named(g, id);
        names += o.known &&
                 json_array_size(json_object_get(json_object_get(g, "diagnosis"), "named")) > 0;
        wrong += o.right && less;
        bad += !o.right && !less && !accepted;
    }
    printf(
        "\n%d of %d known bugs lost points, %d of them in the bug's part; of %d that were given a name %d were given theirs. "
        "Right programs that lost points: %d. The pictures took %.0f CPU seconds.\n",
        lost, bugs, there, names, named, wrong, cpu_s);
    fputs("Of those with a picture that costs no points these have noise like nobody else's:",
          stdout);
    json_array_foreach(grades, i, g)
    {
        if (has_right_image(g) && json_array_size(json_object_get(g, "alike")) == 0)
            printf(" %s", text_of(g, "id"));
    }
    puts(".");
    json_decref(grades);
    return wrong > 0 || bad > 0;
}
