/* What the flight library asks of a C library, so that none is linked. -fno-tree-loop-distribute-patterns keeps the
   compiler from making a loop into a call of the function that it is in. */
#include <stddef.h>

void* memcpy(void* to, const void* from, size_t size) {
  for (size_t i = 0; i < size; ++i) ((unsigned char*)to)[i] = ((const unsigned char*)from)[i];
  return to;
}

void* memset(void* to, int value, size_t size) {
  for (size_t i = 0; i < size; ++i) ((unsigned char*)to)[i] = (unsigned char)value;
  return to;
}

/* From 2^52 on every number is whole; below, adding it rounds to one. */
double floor(double x) {
  const double big = __builtin_copysign(0x1p52, x);
  if (!(__builtin_fabs(x) < 0x1p52)) return x;
  const double whole = (x + big) - big;
  return __builtin_copysign(whole > x ? whole - 1.0 : whole, x);
}
