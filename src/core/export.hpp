// The C interface: what a function that Python calls looks like.
//
// Arrays are row-major and contiguous, numbers are double and int64_t. A function keeps nothing between calls and
// holds no lock, so any number of threads may run it at the same time.
#pragma once

#include <stdint.h>

#if defined(_WIN32)
#define CREEPKIT_API extern "C" __declspec(dllexport)
#else
#define CREEPKIT_API extern "C" __attribute__((visibility("default")))
#endif
