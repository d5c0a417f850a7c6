#include "utc_date.h"

#include <time.h>

struct utc_date utc_date_now(void)
{
    struct utc_date date;
    struct tm utc;
    const time_t now = time(NULL);
    strftime(date.s, sizeof date.s, "%Y-%m-%dT%H:%M:%SZ", gmtime_r(&now, &utc));
    return date;
}
