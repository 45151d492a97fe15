// The memory of a page: a stack in the place of the heap, so that it never grows and arrays of JavaScript in it stay
// valid. What a call takes is given back all at once.
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "law.hpp"

static constexpr size_t SIZE = 56 << 20, BOUNDARY = 64;
alignas(BOUNDARY) static char memory[SIZE];
static size_t used = 0;

extern "C" void* malloc(size_t size) {
    const size_t taken = (size + BOUNDARY - 1) & ~(BOUNDARY - 1);
    if (size > SIZE || taken > SIZE - used) return nullptr;
    used += taken;
    return memory + (used - taken);
}

extern "C" void* calloc(size_t count, size_t size) {
    void* taken = malloc(count * size);
    return taken ? memset(taken, 0, count * size) : nullptr;
}

extern "C" void free(void*) {}

// Zeros for JavaScript; null when memory runs out.
CREEPKIT_PAGE_API void* creepkit_page_zeros(int32_t bytes) { return calloc(1, size_t(bytes)); }

// How much is taken, and give back what was taken since.
CREEPKIT_PAGE_API int32_t creepkit_page_used() { return int32_t(used); }
CREEPKIT_PAGE_API void creepkit_page_release(int32_t before) { used = size_t(before); }
