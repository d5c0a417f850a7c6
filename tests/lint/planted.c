/* Faults that the tools of `make lint` have to see, the first behind a loop of jansson's. */
#include <jansson.h>

int planted(json_t *array);

int planted(json_t *array)
{
    int sum = 0, *none = NULL, few[3] = {0};
    json_t *v;
    size_t i;
    json_array_foreach(array, i, v)
    {
        sum += few[5];
    }
    return sum + *none;
}
