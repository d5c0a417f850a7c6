/* Drives POV-Ray: a process for each image, side by side. */
#ifndef ASSAY_POVRAY_DRIVER_H
#define ASSAY_POVRAY_DRIVER_H

#include "reference/replicates/engine_driver.h"

extern const struct engine_driver povray_driver;

#endif
