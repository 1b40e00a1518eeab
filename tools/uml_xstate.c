// Preloaded into user-mode Linux on processors whose state is larger than it knows (AMX). User-mode Linux
// writes back a part of the state, which the host refuses. This ptrace completes it with the rest of the
// current state, which guests do not use.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/uio.h>

typedef long (*Ptrace)(enum __ptrace_request, int, void*, void*);

long ptrace(enum __ptrace_request request, ...) {
  static Ptrace next;
  static _Alignas(64) char state[1 << 16];
  va_list arguments;
  va_start(arguments, request);
  const int process = va_arg(arguments, int);
  void* const address = va_arg(arguments, void*);
  void* const data = va_arg(arguments, void*);
  va_end(arguments);
  if (next == NULL) next = (Ptrace)dlsym(RTLD_NEXT, "ptrace");
  if (request == PTRACE_SETREGSET && (long)address == NT_X86_XSTATE) {
    const struct iovec* const given = data;
    struct iovec whole = {state, sizeof(state)};
    if (next(PTRACE_GETREGSET, process, address, &whole) == 0 && whole.iov_len > given->iov_len) {
      memcpy(state, given->iov_base, given->iov_len);
      return next(request, process, address, &whole);
    }
  }
  return next(request, process, address, data);
}
