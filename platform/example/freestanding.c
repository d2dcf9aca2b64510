/* SPDX-License-Identifier: Apache-2.0 */
/* The four functions that GCC may call in any code, so that no C library is linked: the compiler chooses among them, and
   another version chooses otherwise. -fno-tree-loop-distribute-patterns keeps it from making a loop into a call of the
   function that it is in. */
#include <stddef.h>

void* memcpy(void* to, const void* from, size_t size) {
  for (size_t i = 0; i < size; ++i) ((unsigned char*)to)[i] = ((const unsigned char*)from)[i];
  return to;
}

void* memmove(void* to, const void* from, size_t size) {
  unsigned char* const t = to;
  const unsigned char* const f = from;
  if (t < f) {
    for (size_t i = 0; i < size; ++i) t[i] = f[i];
  } else {
    for (size_t i = size; i > 0; --i) t[i - 1] = f[i - 1];
  }
  return to;
}

void* memset(void* to, int value, size_t size) {
  for (size_t i = 0; i < size; ++i) ((unsigned char*)to)[i] = (unsigned char)value;
  return to;
}

int memcmp(const void* a, const void* b, size_t size) {
  const unsigned char* const p = a;
  const unsigned char* const q = b;
  for (size_t i = 0; i < size; ++i) {
    if (p[i] != q[i]) return p[i] < q[i] ? -1 : 1;
  }
  return 0;
}
