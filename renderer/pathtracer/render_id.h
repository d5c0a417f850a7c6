/* Which render an image or a state belongs to: what has to be the same for its samples to be samples
 * of the same image. Goes into the metadata of images and the head of state files. */
#ifndef ASSAY_RENDER_ID_H
#define ASSAY_RENDER_ID_H

#include "options.h"
#include "renderer/scene/scene.h"

struct render_id {
    char scene[65];     /* SHA-256 of the scene file, lower-case hex */
    char settings[512]; /* options that affect samples: "integrator path; direct mis; ..." */
    char adaptive[96];  /* "off", "rule N TOL" or "pilot N TOL most SPP" */
    char seed[24];
    char cell[64]; /* "X Y DX DY of W H", origin at the bottom left */
    uint32_t first_sample;
};

/* Reads and hashes the scene file, camera and environment file, and all other files of the loaded scene. False with a
 * line if one cannot be read. */
NODISCARD bool render_id_make(const struct options *o, const struct scene *s, struct render_id *id,
                              struct err *e);

/* X Y DX DY and the W and H of the whole -> "X Y DX DY of W H". */
void render_id_cell(const int cell[4], int width, int height, char text[64]);
/* "X Y DX DY of W H" -> six numbers; false on anything else or a cell that is not inside. */
NODISCARD bool render_id_parse_cell(const char *text, int cell[6]);

#endif
