/* What became of a submission's runs, in words (not started, printed its usage, hung), and which
 * images are not worth a try. */
#include "submission.h"

#include "tools/base/text.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

const char submission_not_made[] = "there is no image, see what is said of all of it";

enum { CHEAPER = 8, HOPELESS = 3 };

/* Roughly in proportion to the time that the image takes. */
static double work_of(const struct rubric_image *p)
{
    return (double)p->width * p->height * p->spp * (1.0 + (double)p->lights * p->bounces);
}

static bool hung(const struct made *m)
{
    return m->end == SANDBOX_WALL || m->end == SANDBOX_CPU;
}

bool submission_will_hang(const struct rubric *r, const struct made *made, int image,
                          struct made *out)
{
    const struct rubric_image *p = &r->image[image];
    int scenes = 0;
    bool any = false;
    *out = (struct made){.end = SANDBOX_WALL};
    for (int i = 0; i < image; i++) {
        const struct rubric_image *q = &r->image[i];
        any = any || made[i].path[0] != '\0';
        if (!hung(&made[i]))
            continue;
        scenes += made[i].wall_s > 0;
        if (strcmp(p->scene, q->scene) == 0 && CHEAPER * work_of(p) >= work_of(q)) {
            snprintf(out->why, sizeof out->why,
                     "not run, as the program did not end on this scene before (image '%s')",
                     q->name);
            return true;
        }
    }
    if (!any && scenes >= HOPELESS)
        snprintf(out->why, sizeof out->why,
                 "not run, as the program did not end on any of %d scenes before", scenes);
    return out->why[0] != '\0';
}

/* Copies the first line of a program's text, in printable ASCII. */
static void take_line(const char *line, char *out, size_t size)
{
    size_t n = 0;
    for (; *line != '\0' && *line != '\n' && n + 1 < size; line++)
        out[n++] = *line >= ' ' && *line <= '~' ? *line : '?';
    out[n] = '\0';
}

bool submission_printed_usage(const char *log, char *why, size_t size)
{
    char line[512];
    bool usage = false;
    why[0] = '\0';
    FILE *f = fopen(log, "r");
    for (int i = 0; f != NULL && !usage && i < 200 && fgets(line, sizeof line, f) != NULL; i++) {
        const char *at = line + strspn(line, " \t");
        usage = strncasecmp(at, "usage", 5) == 0 && !isalnum((unsigned char)at[5]);
        /* A complaint of getopt(3) says more than the usage text. */
        bool complaint = strstr(at, "option") != NULL || strstr(at, "argument") != NULL;
        if (why[0] == '\0' && (usage || complaint))
            take_line(at, why, size);
    }
    if (f != NULL)
        fclose(f);
    return usage;
}

/* What a compiler warned of a function that ends without returning a value: what the program then does depends on
 * the compiler, and a student's own may have been kinder. */
static void missing_return(const char *log, char *out, size_t size)
{
    char line[512];
    out[0] = '\0';
    FILE *f = fopen(log, "r");
    while (f != NULL && out[0] == '\0' && fgets(line, sizeof line, f) != NULL)
        if (strstr(line, "warning: ") != NULL && (strstr(line, "non-void function") != NULL ||
                                                  strstr(line, "returning non-void") != NULL))
            take_line(line, out, size);
    if (f != NULL)
        fclose(f);
}

/* Puts the warning behind the signal, before what the program printed. */
static void tell_warning(const char *warned, char why[400])
{
    char rest[400] = "", *end = strstr(why, "): ");
    if (end != NULL) {
        snprintf(rest, sizeof rest, "%s", end + 1);
        end[1] = '\0';
    }
    text_append(why, 400, "; its build warned: %s", warned);
    text_append(why, 400, "%s", rest);
}

void submission_conclude(const struct rubric *r, const struct made *made, char (*why)[400],
                         const char *build_log, struct submission *s)
{
    char warned[200];
    bool usage = true, same = true, any = s->kind == SUBMISSION_IMAGES;
    missing_return(build_log, warned, sizeof warned);
    for (int i = 0; warned[0] != '\0' && i < r->num_images; i++)
        if (strstr(why[i], "killed by signal") != NULL)
            tell_warning(warned, why[i]);
    for (int i = 0; i < r->num_images; i++) {
        if (why[i][0] == '\0' || s->state != SUBMISSION_GRADED)
            return;
        any = any || made[i].path[0] != '\0';
        usage = usage && made[i].usage;
        same = same && strcmp(why[i], why[0]) == 0;
    }
    if (!any)
        s->state = usage ? SUBMISSION_USAGE : SUBMISSION_NOT_STARTED;
    const char *what = any     ? "None of its images can be judged"
                       : usage ? "It prints its usage text for every image"
                               : "No run of it made an image";
    const char *text = usage ? strchr(why[0], ':') + 2 : why[0];
    snprintf(s->why, sizeof s->why, "%s: %s%s%s%.400s", what, same ? "" : "'",
             same ? "" : r->image[0].name, same ? "" : "': ", text);
    if (s->state == SUBMISSION_NOT_STARTED && warned[0] != '\0' && strstr(s->why, warned) == NULL)
        text_append(s->why, sizeof s->why, "; its build warned: %s", warned);
    for (int i = 0; same && i < r->num_images; i++)
        if (made[i].path[0] == '\0')
            snprintf(why[i], sizeof why[i], "%s", submission_not_made);
}
