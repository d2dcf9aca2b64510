/* SPDX-License-Identifier: Apache-2.0 */
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
