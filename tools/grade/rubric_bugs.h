/* Known bugs on a rubric's own images: a catalogue (catalogue.h) beside the rubric, made by tests/studies/grading/make_rubric_bugs.c. By it
 * a submission of any kind, 8-bit images alone too, is told which bug its images look like; nothing more is rendered.
 *
 * A view is an image, alone or with a set of accepted deviations that changes it. Cells are those of
 * rubric_sight.h; the variance of an effect also holds the noise that the bug adds to one image. */
#ifndef ASSAY_RUBRIC_BUGS_H
#define ASSAY_RUBRIC_BUGS_H

#include "tools/diagnose/diagnose.h"
#include "rubric_sight.h"

struct rubric_bugs {
    struct catalogue catalogue;
    int view[RUBRIC_SETS][RUBRIC_IMAGES]; /* -1: none */
};

/* Whether the image is one of those looked at: with a reference of ours, and of a check that is about what it shows (equal,
 * exact, rates, sum, agree). */
bool rubric_bugs_sees(const struct rubric *r, int image);
/* The first set of deviations whose reference is, bit by bit, that of `set`. */
int rubric_bugs_set(const struct answer_key *a, int set, int image);
/* May the catalogue have a view of its own for images with these deviations? If they are none or a single one by words; others,
 * and those that it has not, are derived. */
bool rubric_bugs_measures(const struct rubric *r, int set);
/* Of such a view: its name, and a hash of all that decides the correct image. */
NODISCARD bool rubric_bugs_key(const struct rubric *r, int set, int image, char name[128],
                               char key[65], struct err *e);

/* Reads r->bugs, and makes the views with deviations that it has not: there a bug changes the light of a cell by the factor by which it
 * changes that of the image with one of them, or the right one. Fails if a view without deviations is missing or has been made of another image. The caller closes it. */
NODISCARD bool rubric_bugs_open(const struct rubric *r, const struct answer_key *a,
                                struct rubric_bugs *out, struct err *e);
void rubric_bugs_close(struct rubric_bugs *b);

/* Has the image a view with these deviations, and did the student make it? If so: its cells. */
bool rubric_bugs_can_observe(const struct grading *g, int set, int image);
NODISCARD bool rubric_bugs_observe(const struct grading *g, int set, int image,
                                   struct observation *out, struct err *e);

/* What these images look like, graded with the deviations of `set`; where no bug explains them with those, with any
 * other set. found->finding is FINDING_CORRECT where nothing was seen; *with: the set by which it was found. A right program
 * is told a bug with a probability of at most alpha for each set, as far as its images are independent (not if all
 * have one seed). without: as in struct diagnose_options. */
NODISCARD bool rubric_bugs_diagnose(const struct grading *g, int set, const char *without,
                                    struct diagnosis *found, int *with, struct err *e);

#endif
