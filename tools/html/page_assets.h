/* The page's style sheet and script, as they stand in page.css and page*.js, inside the program. */
#ifndef ASSAY_PAGE_ASSETS_H
#define ASSAY_PAGE_ASSETS_H

extern const char page_css[]; /* NUL-terminated */
extern const char page_js[];

#endif
