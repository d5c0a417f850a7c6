/* The command line of pathtracer. */
#ifndef ASSAY_OPTIONS_H
#define ASSAY_OPTIONS_H

#include "renderer/transport/render.h"

enum { MAX_OUTPUTS = 8, MAX_SEEDS = 64 };

enum { FRESNEL_EXACT, FRESNEL_SCHLICK }; /* options.fresnel */
enum { FRAME_CROP, FRAME_WHOLE };        /* options.frame */

struct options {
    const char *scene, *camera_file, *environment_file;
    const char *camera_name;         /* in the scene; not together with a file */
    const char *output[MAX_OUTPUTS]; /* each ends in .exr or .png */
    int num_outputs;
    const char *heatmap; /* PNG file; NULL: none */
    const char *resume;  /* the image to go on with; NULL: from the start */
    int width, height;
    int cell[4]; /* x y dx dy, origin at the bottom left */
    int dialect, accel, isa, kind, direct, fresnel, sampler, frame, guiding;
    unsigned starter; /* 1 << enum cs184_deviation (cs184_deviations.h) */
    int spp;          /* paths per pixel, in all shares; the most if adaptive */
    int first, last;  /* sample numbers first .. last-1 are this program's share */
    int light_samples, threads, max_bounces, first_bounce;
    int accumulate; /* 0: only light that bounced exactly max_bounces times: first_bounce is set to it */
    bool quiet, aov, keep_state;
    enum roulette_kind roulette;
    double survival; /* of ROULETTE_FIXED */
    uint64_t seed;   /* of several the first */
    uint64_t seeds[MAX_SEEDS];
    int num_seeds;      /* 0: seed alone */
    int adaptive_batch; /* 0: off */
    double adaptive_tolerance;
    int pilot;                                  /* samples */
    double pilot_tolerance;                     /* negative: no pilot */
    double lens_radius, focal_distance;         /* negative: not given */
    double max_seconds, max_error, write_every; /* 0: off */
    struct pixel_filter filter;
    int slurm; /* jobs on a cluster; 0: render here */
    enum { ACTION_RENDER, ACTION_CAMERAS, ACTION_HELP, ACTION_VERSION, ACTION_LIST } action;
};

/* cli_apart() for a command line that options_parse() has accepted. */
NODISCARD char **options_apart(int argc, char **argv);
/* Fills *o from the command line, with defaults where it is silent. An action other than
 * ACTION_RENDER leaves the rest unchecked, but for the scene of ACTION_CAMERAS. */
NODISCARD bool options_parse(int argc, char **argv, struct options *o, struct err *e);

/* Prints what --help, --version and --list say, on stdout; nothing for other actions. */
void options_print(const struct options *o);

/* True if a file name ends in .exr; those of output[] otherwise end in .png. */
bool image_is_exr(const char *path);

#endif
