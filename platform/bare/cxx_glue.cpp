// What the C++ headers ask of a C++ library that is not there. Tests only.
#include <cstdlib>
#include <new>
#include <string>

#include "platform/bare/board.h"

namespace {

[[noreturn]] void stop(const char* what) {
  board_put(what);
  board_put("\n");
  board_exit(2);
}

void* take(std::size_t size) {
  void* const memory = std::malloc(size > 0 ? size : 1);
  if (memory == nullptr) stop("no memory");
  return memory;
}

}  // namespace

void* operator new(std::size_t size) { return take(size); }
void* operator new[](std::size_t size) { return take(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t /*size*/) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t /*size*/) noexcept { std::free(memory); }

// The headers leave the instantiation to the library.
template class std::basic_string<char>;

namespace std {

void __throw_length_error(const char* what) { stop(what); }
void __throw_logic_error(const char* what) { stop(what); }
void __throw_out_of_range_fmt(const char* what, ...) { stop(what); }
void __throw_bad_alloc() { stop("bad_alloc"); }
void __throw_bad_array_new_length() { stop("bad_array_new_length"); }

}  // namespace std
