// Numbers of some columns of a table in text, for Python.
#include "number_table.hpp"

#include "export.hpp"

// text: length bytes. delimiter, decimal: characters; the delimiter ' ' stands for runs of blanks and tabs. places:
// (columns,). out: (capacity, wanted). where: (3,). Returns the number of rows, or a NumberTableError.
CREEPKIT_API int64_t creepkit_read_number_table(const char* text, int64_t length, int64_t delimiter, int64_t decimal,
                                                int64_t columns, const int64_t* places, int64_t wanted,
                                                int64_t capacity, double* out, int64_t* where) {
    const creepkit::NumberTable table = {text, length, char(delimiter), char(decimal), columns, places};
    return table.read(wanted, capacity, out, where);
}
