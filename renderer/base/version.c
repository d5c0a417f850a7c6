#include "version.h"

const char assay_version[] = ASSAY_VERSION " (commit " ASSAY_COMMIT ")";
