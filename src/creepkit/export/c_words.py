"""Names that C and C++ keep for themselves: no parameter or internal variable of a law may be called so."""

from __future__ import annotations

_KEYWORDS = """
auto break case char const continue default do double else enum extern float for goto if inline int long register
restrict return short signed sizeof static struct switch typedef union unsigned void volatile while _Bool _Complex
_Imaginary asm typeof main
"""
"""C99, with the words that compilers add."""

_CPP_KEYWORDS = """
alignas alignof and and_eq bitand bitor bool catch char8_t char16_t char32_t class co_await co_return co_yield compl
concept const_cast consteval constexpr constinit decltype delete dynamic_cast explicit export false friend mutable
namespace new noexcept not not_eq nullptr operator or or_eq private protected public reinterpret_cast requires
static_assert static_cast template this thread_local throw true try typeid typename using virtual wchar_t xor xor_eq
std min max abs eval
"""
"""What C++20 has beside C99, and names that code for it calls unqualified."""

_MATH_FUNCTIONS = """
acos asin atan atan2 cos sin tan acosh asinh atanh cosh sinh tanh exp exp2 expm1 frexp ilogb ldexp log log10 log1p log2
logb modf scalbn scalbln cbrt fabs hypot pow sqrt erf erfc lgamma tgamma ceil floor nearbyint rint lrint llrint round
lround llround trunc fmod remainder remquo copysign nan nextafter nexttoward fdim fmax fmin fma cabs cacos cacosh carg
casin casinh catan catanh ccos ccosh cexp cimag clog conj cpow cproj creal csin csinh csqrt ctan ctanh gamma j0 j1 jn y0
y1 yn drem scalb significand exp10 pow10
"""
"""math.h and complex.h, with what Unix adds: compilers know these as functions, included or not; also with f and l."""

_LIBRARY_NAMES = """
fpclassify isfinite isinf isnan isnormal signbit isgreater isgreaterequal isless islessequal islessgreater isunordered
signgam matherr math_errhandling float_t double_t INFINITY NAN HUGE_VAL abort atexit atof atoi atol atoll bsearch calloc
div exit free getenv labs ldiv llabs lldiv malloc qsort rand realloc srand strtod strtol system isalnum isalpha isblank
iscntrl isdigit isgraph islower isprint ispunct isspace isupper isxdigit tolower toupper fclose fopen fprintf fputc
fputs fread fscanf fwrite printf putc putchar puts remove rename rewind scanf snprintf sprintf sscanf vfprintf vprintf
vscanf vsnprintf vsprintf memchr memcmp memcpy memmove memset strcat strchr strcmp strcpy strcspn strlen strncat strncmp
strncpy strpbrk strrchr strspn strstr strftime alloca bcmp bcopy bzero dcgettext dgettext execl execlp execle execv
execve execvp ffs fork gettext imaxabs index isascii mempcpy rindex stpcpy strdup toascii iswalnum iswalpha towlower
towupper
"""
"""Macros and types of math.h, and functions of other headers that compilers know without them."""

C_RESERVED = frozenset(f"{_KEYWORDS} {_CPP_KEYWORDS} {_LIBRARY_NAMES}".split()) | {
    name + suffix for name in _MATH_FUNCTIONS.split() for suffix in ("", "f", "l")
}
