/* The findings of import_check(), as text and as an exit code. */
#ifndef ASSAY_IMPORT_RESULT_H
#define ASSAY_IMPORT_RESULT_H

#include <jansson.h>
#include <stdio.h>

/* One line per scene, then the sum. */
void import_result_print(FILE *f, const json_t *reports);
/* 0: all agree, or Blender is absent; else 3 if a scene could not be judged, else 1. */
int import_result_exit_code(const json_t *reports);

#endif
