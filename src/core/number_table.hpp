// Numbers of some columns of a table in text, correctly rounded: what creepkit reads frames of cameras with.
//
// A number of at most 2^53 without its decimal sign, and an exponent of at most 22, is the quotient or product of two
// numbers of double without error, and so is rounded once (Clinger 1990, How to read floating point numbers accurately,
// PLDI). One of at most 19 digits and an exponent of at most 27 is a product or quotient of whole numbers of 128 bits,
// rounded to the nearest. All others are left to strtod as digits with an exponent, in which no locale has a say.
#pragma once

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

namespace creepkit {

enum NumberTableError { BAD_CELL_COUNT = -1, NO_NUMBER = -2, TOO_MANY_ROWS = -3 };

constexpr int64_t LONGEST_NUMBER = 400;  // characters

inline bool is_digit(char c) { return c >= '0' && c <= '9'; }

// Whether [p, end) are these letters, in lower case in `word`; what follows in brackets is left out, as of nan(ind).
inline bool is_word(const char* p, const char* end, const char* word) {
    for (; *word; ++word, ++p)
        if (p == end || (*p | 0x20) != *word) return false;
    return p == end || (*p == '(' && end[-1] == ')');
}

// What stands for a number that is none: nan, inf, infinity, and 1.#QNAN, 1.#IND, 1.#INF of older C libraries.
inline bool parse_word(const char* p, const char* end, bool negative, double& value) {
    if (end - p > 3 && p[0] == '1' && p[2] == '#') p += 3;
    if (is_word(p, end, "nan") || is_word(p, end, "qnan") || is_word(p, end, "snan") || is_word(p, end, "ind"))
        value = NAN;
    else if (is_word(p, end, "inf") || is_word(p, end, "infinity"))
        value = negative ? -INFINITY : INFINITY;
    else
        return false;
    return true;
}

using WholeNumber = unsigned __int128;

// `number` times 2^power to the nearest double, of two alike to the even one. inexact: the number is a little larger.
inline double rounded(WholeNumber number, int64_t power, bool inexact) {
    const uint64_t high = uint64_t(number >> 64), low = uint64_t(number);
    const int bits = high ? 128 - __builtin_clzll(high) : 64 - __builtin_clzll(low);
    const int dropped = bits > 53 ? bits - 53 : 0;
    uint64_t kept = uint64_t(number >> dropped);
    if (dropped) {
        const WholeNumber half = WholeNumber(1) << (dropped - 1), rest = number & (2 * half - 1);
        if (rest > half || (rest == half && (inexact || kept % 2))) ++kept;
    }
    return ldexp(double(kept), int(power) + dropped);
}

// A positive number times 10^exponent, for exponents of -27 to 27.
inline double scaled(uint64_t number, int64_t exponent) {
    uint64_t power_of_five = 1;
    for (int64_t k = exponent < 0 ? -exponent : exponent; k > 0; --k) power_of_five *= 5;
    if (exponent >= 0) return rounded(WholeNumber(number) * power_of_five, exponent, false);
    const int shift = __builtin_clzll(number);
    const WholeNumber dividend = WholeNumber(number << shift) << 64, quotient = dividend / power_of_five;
    return rounded(quotient, exponent - 64 - shift, quotient * power_of_five != dividend);
}

// The number in [p, end), NaN where it is empty; false where it is none.
inline bool parse_number(const char* p, const char* end, char decimal, double& value) {
    static const double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    value = NAN;
    if (p == end) return true;
    const bool negative = *p == '-';
    if (*p == '-' || *p == '+') ++p;
    const char* start = p;
    if (end - p > LONGEST_NUMBER) return false;
    uint64_t mantissa = 0;
    int64_t digits = 0, exponent = 0;
    bool seen = false, fraction = false;
    for (; p < end; ++p) {
        if (is_digit(*p)) {
            seen = true;
            if (digits || *p != '0') ++digits;
            if (digits <= 19) mantissa = 10 * mantissa + uint64_t(*p - '0');
            if (fraction) --exponent;
        } else if (*p == decimal && !fraction) {
            fraction = true;
        } else {
            break;
        }
    }
    if (!seen) return parse_word(start, end, negative, value);
    const char* mantissa_end = p;
    if (p < end) {
        if ((*p | 0x20) != 'e' && (*p | 0x20) != 'd') return parse_word(start, end, negative, value);
        ++p;
        const bool small = p < end && *p == '-';
        if (p < end && (*p == '-' || *p == '+')) ++p;
        if (p == end) return false;
        int64_t power = 0;
        for (; p < end && is_digit(*p); ++p)
            if (power < 100000) power = 10 * power + (*p - '0');
        if (p < end) return false;
        exponent += small ? -power : power;
    }
    if (digits == 0) {
        value = 0.0;
    } else if (digits <= 19 && mantissa <= (uint64_t(1) << 53) && exponent >= -22 && exponent <= 22) {
        value = exponent < 0 ? double(mantissa) / powers[-exponent] : double(mantissa) * powers[exponent];
    } else if (digits <= 19 && exponent >= -27 && exponent <= 27) {
        value = scaled(mantissa, exponent);
    } else {
        char copy[LONGEST_NUMBER + 32];
        char* out = copy;
        for (const char* c = start; c < mantissa_end; ++c)
            if (is_digit(*c)) *out++ = *c;
        *out++ = 'e';
        if (exponent < 0) *out++ = '-';
        char figures[24];
        int count = 0;
        uint64_t rest = uint64_t(exponent < 0 ? -exponent : exponent);
        do figures[count++] = char('0' + rest % 10); while (rest /= 10);
        while (count) *out++ = figures[--count];
        *out = '\0';
        value = strtod(copy, nullptr);
    }
    if (negative) value = -value;
    return true;
}

// What spreadsheets write for a value that could not be computed; a row may begin so, a remark does not.
inline bool begins_with_error_value(const char* p, const char* end) {
    static const char* const words[] = {"#REF!",  "#DIV/0!", "#N/A",    "#VALUE!", "#NAME?",
                                        "#NUM!",  "#NULL!",  "#SPILL!", "#CALC!",  "#####"};
    for (const char* word : words) {
        const int64_t length = int64_t(strlen(word));
        if (end - p >= length && memcmp(p, word, size_t(length)) == 0) return true;
    }
    return false;
}

// A table: its bytes, how its cells are divided, the number of cells in a row, and (columns,) the place in a row of the
// result of each column, or -1 where it is not wanted.
struct NumberTable {
    const char* text;
    int64_t length;
    char delimiter, decimal;
    int64_t columns;
    const int64_t* places;

    // Rows that were read, or a NumberTableError with where it is: (3,) first byte, one past the last, column.
    // Blank lines and remarks, which begin with #, are left out; one empty cell too many at the end of a row is, too.
    int64_t read(int64_t wanted, int64_t capacity, double* out, int64_t* where) const {
        const char *p = text, *const end = text + length;
        int64_t row = 0;
        while (p < end) {
            const char* line = p;
            while (p < end && (*p == ' ' || *p == '\t')) ++p;
            if (p == end) break;
            if (*p == '\n' || *p == '\r') {
                ++p;
                continue;
            }
            if (*p == '#' && !begins_with_error_value(p, end)) {
                while (p < end && *p != '\n' && *p != '\r') ++p;
                continue;
            }
            if (delimiter != ' ') p = line;
            if (row == capacity) return failed(TOO_MANY_ROWS, line, line, 0, where);
            const int64_t error = read_row(p, end, out + row * wanted, where);
            if (error) return error;
            ++row;
        }
        return row;
    }

private:
    int64_t failed(int64_t error, const char* first, const char* last, int64_t column, int64_t* where) const {
        where[0] = first - text;
        where[1] = last - text;
        where[2] = column;
        return error;
    }

    int64_t read_row(const char*& p, const char* end, double* values, int64_t* where) const {
        const char* line = p;
        for (int64_t column = 0;; ++column) {
            while (p < end && (*p == ' ' || (*p == '\t' && delimiter != '\t'))) ++p;
            const char *first = p, *last = p;
            if (p < end && *p == '"') {
                first = ++p;
                while (p < end && *p != '"' && *p != '\n' && *p != '\r') ++p;
                last = p;
                if (p < end && *p == '"') ++p;
                else return failed(NO_NUMBER, first - 1, p, column, where);
                while (p < end && *p == ' ' && delimiter != ' ') ++p;
                if (!ends_cell(p, end)) return failed(NO_NUMBER, first - 1, p, column, where);
            } else {
                while (!ends_cell(p, end)) ++p;
                last = p;
            }
            while (last > first && (last[-1] == ' ' || last[-1] == '\t')) --last;
            while (first < last && *first == ' ') ++first;
            const bool at_end = ends_row(p, end);
            if (column < columns) {
                const int64_t place = places[column];
                if (place >= 0 && !parse_number(first, last, decimal, values[place]))
                    return failed(NO_NUMBER, first, last, column, where);
            } else if (!(at_end && first == last)) {
                while (!ends_row(p, end)) ++p;
                return failed(BAD_CELL_COUNT, line, p, column, where);
            }
            if (at_end) {
                if (column + 1 < columns) return failed(BAD_CELL_COUNT, line, p, column, where);
                return 0;
            }
            ++p;
            if (delimiter == ' ') {
                while (p < end && (*p == ' ' || *p == '\t')) ++p;
                if (ends_row(p, end)) {
                    if (column + 1 < columns) return failed(BAD_CELL_COUNT, line, p, column, where);
                    return 0;
                }
            }
        }
    }

    bool ends_row(const char* p, const char* end) const { return p >= end || *p == '\n' || *p == '\r'; }
    bool ends_cell(const char* p, const char* end) const {
        return ends_row(p, end) || *p == delimiter || (delimiter == ' ' && *p == '\t');
    }
};

}  // namespace creepkit
