/* ptrace(2) for a user-mode Linux on a processor with AMX.

   The host takes a process's extended registers back whole only: eleven kilobytes where there are AMX tiles.
   The kernel, of a time before these, has room for AVX-512 alone and is refused. What it gives is laid over what the
   process has; tiles, which nothing in the guest may use, stay as they are. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/uio.h>

enum { EXTENDED = 0x202 }; /* NT_X86_XSTATE */

typedef long (*Ptrace)(int, long, void *, void *);

long ptrace(enum __ptrace_request request, ...)
{
    static char registers[1 << 16];
    static Ptrace of_host;
    va_list arguments;
    long process;
    void *address, *data;

    va_start(arguments, request);
    process = va_arg(arguments, int);
    address = va_arg(arguments, void *);
    data = va_arg(arguments, void *);
    va_end(arguments);
    if (!of_host)
        of_host = (Ptrace)dlsym(RTLD_NEXT, "ptrace");
    if (request == PTRACE_SETREGSET && (long)address == EXTENDED) {
        struct iovec *given = data, whole = {registers, sizeof registers};
        if (of_host(PTRACE_GETREGSET, process, address, &whole) == 0 && given->iov_len < whole.iov_len) {
            memcpy(registers, given->iov_base, given->iov_len);
            return of_host(request, process, address, &whole);
        }
    }
    return of_host(request, process, address, data);
}
