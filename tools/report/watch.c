#include "watch.h"

#include <dirent.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <microhttpd.h>

struct watch {
    char dir[4096];
    int port;
    struct MHD_Daemon *daemon;
};

static const char frame_html[] =
    "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
    "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">"
    "<meta name=\"color-scheme\" content=\"light dark\"><title>assay watch</title>\n"
    "<style>html,body{margin:0;height:100%}body{display:flex;flex-direction:column;"
    "font:14px system-ui,sans-serif}#line{margin:0;padding:.3rem .8rem}"
    "iframe{flex:1;border:0;width:100%}</style></head>\n"
    "<body><p id=\"line\" role=\"status\">Waiting for a first report.</p>"
    "<iframe title=\"The latest report\"></iframe><script src=\"/watch.js\"></script></body></html>\n";

static const char frame_js[] =
    "\"use strict\";\n"
    "const frame = document.querySelector(\"iframe\"), line = document.getElementById(\"line\");\n"
    "let last = \"\";\n"
    "async function look() {\n"
    "  try {\n"
    "    const state = await (await fetch(\"/state\", { cache: \"no-store\" })).text();\n"
    "    if (state !== last && state !== \"\") {\n"
    "      if (last === \"\") frame.src = \"/report\";\n"
    "      else frame.contentWindow.location.reload();\n"
    "      line.textContent = state.split(\"\\t\")[0] + \", shown since \" + new Date().toLocaleTimeString();\n"
    "    }\n"
    "    last = state;\n"
    "  } catch (e) {\n"
    "    line.textContent = \"assay watch has ended; this is the last report it showed.\";\n"
    "  }\n"
    "  setTimeout(look, 1000);\n"
    "}\n"
    "look();\n";

static bool is_newer(const struct stat *a, const struct stat *b)
{
    return a->st_mtim.tv_sec != b->st_mtim.tv_sec ? a->st_mtim.tv_sec > b->st_mtim.tv_sec
                                                  : a->st_mtim.tv_nsec > b->st_mtim.tv_nsec;
}

/* Takes dir/name/index.html (name "": dir/index.html) if it is a file newer than *newest. */
static void consider(const char *dir, const char *name, char path[8192], struct stat *newest)
{
    char here[8192];
    struct stat st;
    int n = snprintf(here, sizeof here, "%s/%s%sindex.html", dir, name, name[0] != '\0' ? "/" : "");
    if (n < 0 || (size_t)n >= sizeof here || stat(here, &st) != 0 || !S_ISREG(st.st_mode))
        return;
    if (path[0] != '\0' && !is_newer(&st, newest))
        return;
    strcpy(path, here);
    *newest = st;
}

/* "" where there is no page. */
static void find_page(const struct watch *w, char path[8192], struct stat *newest)
{
    path[0] = '\0';
    consider(w->dir, "", path, newest);
    DIR *d = opendir(w->dir);
    for (struct dirent *entry; d != NULL && (entry = readdir(d)) != NULL;)
        if (entry->d_name[0] != '.')
            consider(w->dir, entry->d_name, path, newest);
    if (d != NULL)
        closedir(d);
}

static enum MHD_Result answer(struct MHD_Connection *to, unsigned status, const char *type,
                              const char *policy, struct MHD_Response *response)
{
    if (response == NULL)
        return MHD_NO;
    MHD_add_response_header(response, "Content-Type", type);
    MHD_add_response_header(response, "Cache-Control", "no-store");
    MHD_add_response_header(response, "X-Content-Type-Options", "nosniff");
    if (policy != NULL)
        MHD_add_response_header(response, "Content-Security-Policy", policy);
    enum MHD_Result result = MHD_queue_response(to, status, response);
    MHD_destroy_response(response);
    return result;
}

static enum MHD_Result answer_text(struct MHD_Connection *to, unsigned status, const char *type,
                                   const char *policy, const char *text)
{
    return answer(
        to, status, type, policy,
        MHD_create_response_from_buffer(strlen(text), (void *)text, MHD_RESPMEM_MUST_COPY));
}

static enum MHD_Result answer_page(const struct watch *w, struct MHD_Connection *to)
{
    char path[8192];
    struct stat st;
    find_page(w, path, &st);
    int fd = path[0] != '\0' ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    if (fd < 0 || fstat(fd, &st) != 0) {
        if (fd >= 0)
            close(fd);
        return answer_text(to, MHD_HTTP_NOT_FOUND, "text/plain", NULL, "no report yet\n");
    }
    return answer(to, MHD_HTTP_OK, "text/html; charset=utf-8", NULL,
                  MHD_create_response_from_fd((size_t)st.st_size, fd));
}

static enum MHD_Result answer_state(const struct watch *w, struct MHD_Connection *to)
{
    char path[8192], state[8192 + 96] = "";
    struct stat st;
    find_page(w, path, &st);
    if (path[0] != '\0')
        snprintf(state, sizeof state, "%s\t%lld.%09ld\t%lld", path, (long long)st.st_mtim.tv_sec,
                 st.st_mtim.tv_nsec, (long long)st.st_size);
    return answer_text(to, MHD_HTTP_OK, "text/plain; charset=utf-8", NULL, state);
}

static bool names_this_host(const struct watch *w, struct MHD_Connection *to)
{
    const char *host = MHD_lookup_connection_value(to, MHD_HEADER_KIND, "Host");
    char numeric[32], name[32];
    snprintf(numeric, sizeof numeric, "127.0.0.1:%d", w->port);
    snprintf(name, sizeof name, "localhost:%d", w->port);
    return host != NULL && (strcmp(host, numeric) == 0 || strcmp(host, name) == 0);
}

static enum MHD_Result handle(void *ctx, struct MHD_Connection *to, const char *url,
                              const char *method, const char *version, const char *upload,
                              size_t *upload_size, void **state)
{
    static const char policy[] =
        "default-src 'none'; style-src 'unsafe-inline'; script-src 'self'; "
        "frame-src 'self'; connect-src 'self'";
    const struct watch *w = ctx;
    (void)version, (void)upload, (void)upload_size, (void)state;
    if (!names_this_host(w, to))
        return answer_text(to, MHD_HTTP_FORBIDDEN, "text/plain", NULL, "not this host\n");
    if (strcmp(method, "GET") != 0 && strcmp(method, "HEAD") != 0)
        return answer_text(to, MHD_HTTP_METHOD_NOT_ALLOWED, "text/plain", NULL, "GET only\n");
    if (strcmp(url, "/") == 0)
        return answer_text(to, MHD_HTTP_OK, "text/html; charset=utf-8", policy, frame_html);
    if (strcmp(url, "/watch.js") == 0)
        return answer_text(to, MHD_HTTP_OK, "text/javascript; charset=utf-8", NULL, frame_js);
    if (strcmp(url, "/report") == 0)
        return answer_page(w, to);
    if (strcmp(url, "/state") == 0)
        return answer_state(w, to);
    return answer_text(to, MHD_HTTP_NOT_FOUND, "text/plain", NULL, "nothing here\n");
}

bool watch_start(const char *dir, int *port, struct watch **out, struct err *e)
{
    struct stat st;
    if (stat(dir, &st) != 0 || !S_ISDIR(st.st_mode))
        return err_set(e, "%s: not a directory", dir);
    struct watch *w = calloc(1, sizeof *w);
    if (w == NULL)
        return err_set(e, "out of memory");
    if ((size_t)snprintf(w->dir, sizeof w->dir, "%s", dir) >= sizeof w->dir) {
        free(w);
        return err_set(e, "%.64s...: path too long", dir);
    }
    w->port = *port;
    struct sockaddr_in address = {.sin_family = AF_INET,
                                  .sin_port = htons((uint16_t)*port),
                                  .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    w->daemon = MHD_start_daemon(MHD_USE_INTERNAL_POLLING_THREAD, (uint16_t)*port, NULL, NULL,
                                 handle, w, MHD_OPTION_SOCK_ADDR, &address,
                                 MHD_OPTION_CONNECTION_TIMEOUT, 10u, MHD_OPTION_END);
    const union MHD_DaemonInfo *info =
        w->daemon != NULL ? MHD_get_daemon_info(w->daemon, MHD_DAEMON_INFO_BIND_PORT) : NULL;
    if (info == NULL) {
        watch_stop(w);
        return err_set(e, "port %d of 127.0.0.1 cannot be had", *port);
    }
    if (*port == 0) /* and nobody knows it before it is printed */
        w->port = *port = info->port;
    *out = w;
    return true;
}

void watch_stop(struct watch *w)
{
    if (w == NULL)
        return;
    if (w->daemon != NULL)
        MHD_stop_daemon(w->daemon);
    free(w);
}
