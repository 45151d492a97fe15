// Memory of one call: taken once, given back whole, all of it zero at first.
#pragma once

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

namespace creepkit {

// A stack of arrays, each on a boundary of 64 bytes. Ask for all of them with the same code twice: first without
// memory, which adds up what is needed, then with it.
class Workspace {
public:
    Workspace() = default;
    Workspace(const Workspace&) = delete;
    Workspace& operator=(const Workspace&) = delete;
    ~Workspace() { free(memory_); }

    // Take the memory that was asked for so far; false when there is none.
    bool allocate() {
        memory_ = calloc(1, used_ + 64);
        if (!memory_) return false;
        base_ = reinterpret_cast<char*>((reinterpret_cast<uintptr_t>(memory_) + 63) & ~uintptr_t(63));
        used_ = 0;
        return true;
    }

    // The next array of so many numbers; null before `allocate`.
    template <class Number>
    Number* array(int64_t count) {
        char* start = base_ ? base_ + used_ : nullptr;
        used_ += (sizeof(Number) * size_t(count > 0 ? count : 1) + 63) & ~size_t(63);
        return reinterpret_cast<Number*>(start);
    }

    double* doubles(int64_t count) { return array<double>(count); }

private:
    void* memory_ = nullptr;
    char* base_ = nullptr;
    size_t used_ = 0;
};

}  // namespace creepkit
