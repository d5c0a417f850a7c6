/* Jansson's loop macros in a form that cppcheck understands; for `make lint` alone. */
#define json_array_foreach(a, i, v)                                                                \
    for (i = 0; i < json_array_size(a) && (v = json_array_get(a, i)); i++)
#define json_object_foreach(o, k, v) for (; (k = json_key(o)) && (v = json_value(o));)
