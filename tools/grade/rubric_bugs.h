/* Known bugs on a rubric's own images: a catalogue (catalogue.h) beside the rubric, made by
 * tests/studies/grading/make_rubric_bugs.c. It names the bug that the images of a submission look like,
 * without further renders; 8-bit images are enough.
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

/* Does the diagnosis use this image? It does if the image has a reference of ours and belongs to a
 * check of what it shows (equal, exact, rates, sum, agree). */
bool rubric_bugs_sees(const struct rubric *r, int image);
/* The first set of deviations whose reference is, bit by bit, that of `set`. */
int rubric_bugs_set(const struct answer_key *a, int set, int image);
/* May the catalogue have a measured view for images with these deviations? Yes for the empty set
 * and for a single deviation given by options; other views, and missing ones, are derived. */
bool rubric_bugs_measures(const struct rubric *r, int set);
/* Name of such a view, and a hash of all that decides its correct image. Fails if a file cannot be
 * read. */
NODISCARD bool rubric_bugs_key(const struct rubric *r, int set, int image, char name[128],
                               char key[65], struct err *e);

/* Reads r->bugs and derives the views with deviations that it lacks: in these a bug changes the light of
 * a cell by the same factor as in the image with one of the deviations, or in the right image. Fails if
 * a view without deviations is missing or was made of another image. The caller closes it. */
NODISCARD bool rubric_bugs_open(const struct rubric *r, const struct answer_key *a,
                                struct rubric_bugs *out, struct err *e);
void rubric_bugs_close(struct rubric_bugs *b);

/* Has the image a view with these deviations, and is there a student's image? The second function
 * returns its cells. */
bool rubric_bugs_can_observe(const struct grading *g, int set, int image);
NODISCARD bool rubric_bugs_observe(const struct grading *g, int set, int image,
                                   struct observation *out, struct err *e);

/* Which bug the images look like with the deviations of `set` or, if no bug explains them with those,
 * with any other set; *with: the set used. found->finding is FINDING_CORRECT where nothing is wrong.
 * A right program is accused with a probability of at most alpha for each set, if its images are
 * independent (they are not if all have one seed). without: as in struct diagnose_options. */
NODISCARD bool rubric_bugs_diagnose(const struct grading *g, int set, const char *without,
                                    struct diagnosis *found, int *with, struct err *e);

/* The same by the images that checks of one part have and none of an earlier part, and by a single bug: a
 * program with a mistake in each part is explained by no bug, and by no pair of them. Not FINDING_BUG where
 * no image of the part can be compared, and where one is black, for which there are many reasons. right, by
 * image: no check of it lost anything; a bug that would be seen in such an image is not named. */
NODISCARD bool rubric_bugs_diagnose_part(const struct grading *g, int set, int part,
                                         const bool *right, struct diagnosis *found, struct err *e);

#endif
