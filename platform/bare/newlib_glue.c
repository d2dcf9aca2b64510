/* What newlib and C++ ask of an operating system. Tests and replays use it; the flight library needs none of it. */
#include "board.h"

#include <stddef.h>

extern char __heap_start[];
extern char __heap_end[];

int _write(int file, const char* bytes, int count) {
  (void)file;
  for (int i = 0; i < count; ++i) board_putc(bytes[i]);
  return count;
}
int _read(int file, char* bytes, int count) {
  (void)file, (void)bytes, (void)count;
  return 0;
}
int _open(const char* path, int flags, int mode) {
  (void)path, (void)flags, (void)mode;
  return -1;
}
int _close(int file) {
  (void)file;
  return -1;
}
int _lseek(int file, int offset, int whence) {
  (void)file, (void)offset, (void)whence;
  return 0;
}
int _fstat(int file, void* status) {
  (void)file, (void)status;
  return -1;
}
int _isatty(int file) {
  (void)file;
  return 1;
}
int _unlink(const char* path) {
  (void)path;
  return -1;
}
int _getpid(void) { return 1; }
int _kill(int process, int signal) {
  (void)process;
  board_exit(128 + signal);
}
void _exit(int code) { board_exit(code); }
void* _sbrk(ptrdiff_t size) {
  static char* top = __heap_start;
  if (size > __heap_end - top) return (void*)-1;
  char* const begin = top;
  top += size;
  return begin;
}

/* Some of newlib calls these by their plain names. */
#define PLAIN(name) __attribute__((alias("_" #name), weak))
int write(int, const char*, int) PLAIN(write);
int read(int, char*, int) PLAIN(read);
int open(const char*, int, int) PLAIN(open);
int close(int) PLAIN(close);
int lseek(int, int, int) PLAIN(lseek);
int fstat(int, void*) PLAIN(fstat);
int isatty(int) PLAIN(isatty);
int unlink(const char*) PLAIN(unlink);
int getpid(void) PLAIN(getpid);
int kill(int, int) PLAIN(kill);
void* sbrk(ptrdiff_t) PLAIN(sbrk);

/* Objects are compiled with the headers of Debian's C library and linked with newlib: names that differ. */
extern int* __errno(void);
int* __errno_location(void) { return __errno(); }

/* _setjmp, the C library's other name of setjmp: newlib has it for SPARC; for PowerPC it is in start.S. */

/* Nothing is destroyed: the image ends with the board. */
void* __dso_handle;
int __cxa_atexit(void (*destroy)(void*), void* object, void* dso) {
  (void)destroy, (void)object, (void)dso;
  return 0;
}
void __cxa_pure_virtual(void) { board_exit(2); }

typedef struct file file;
extern int vsscanf(const char*, const char*, __builtin_va_list);
extern int vfscanf(file*, const char*, __builtin_va_list);
int __isoc99_sscanf(const char* text, const char* format, ...) {
  __builtin_va_list list;
  __builtin_va_start(list, format);
  const int count = vsscanf(text, format, list);
  __builtin_va_end(list);
  return count;
}
int __isoc99_fscanf(file* from, const char* format, ...) {
  __builtin_va_list list;
  __builtin_va_start(list, format);
  const int count = vfscanf(from, format, list);
  __builtin_va_end(list);
  return count;
}
