/* What the course's starter code can read, as tools/docs/background/course-skeleton.md has it: its parser, its half-edge mesh
 * and its normals, walked through. */
#ifndef ASSAY_COURSE_SCENE_H
#define ASSAY_COURSE_SCENE_H

#include <stdbool.h>

/* The first rule that a scene breaks, and where, until the next call; "": none. The text is well-formed XML. */
const char *course_scene_breach(const char *text, bool has_environment);

#endif
