/* The page's style sheet and script (page_plot.css, page.css, page*.js), embedded in the program. */
#ifndef ASSAY_PAGE_ASSETS_H
#define ASSAY_PAGE_ASSETS_H

extern const char page_css[]; /* NUL-terminated */
extern const char page_js[];
extern const char plot_css[]; /* the part of page_css that a plot outside a page needs */

#endif
