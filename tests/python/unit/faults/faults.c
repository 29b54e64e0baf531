/* Faults of a disk, made where a process asks the system: preloaded, and set by ctypes.

   Only files whose path contains a mark are touched. A call is counted when it is about to read or to write such a file;
   the first `after` of them go through. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum { NONE, FAILS, INTERRUPTED, SHORT, KILLED };
enum { READS, WRITES };

static int kind = NONE, code, side;
static long after, calls;
static char mark[512];

/* `error` is the errno of FAILS. */
void fault_set(int new_kind, int new_side, int error, long through, const char *path) {
    side = new_side, code = error, after = through, calls = 0;
    strncpy(mark, path, sizeof mark - 1);
    kind = new_kind;
}

long fault_calls(void) { return calls; }

static int touched(int fd, int asked) {
    char link[64], path[1024];
    if (kind == NONE || asked != side) return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t size = readlink(link, path, sizeof path - 1);
    if (size < 0) return 0;
    path[size] = 0;
    return strstr(path, mark) != NULL;
}

/* Whether this call fails; *count is what a short one may still ask for. */
static int faulty(int fd, int asked, size_t *count) {
    if (!touched(fd, asked)) return 0;
    long call = calls++;
    if (call < after) return 0;
    if (kind == KILLED) raise(SIGKILL);
    if (kind == SHORT && *count > 100) *count = 100;
    errno = kind == INTERRUPTED ? EINTR : code;
    return kind == FAILS || (kind == INTERRUPTED && call % 2 == 0);
}

#define REAL(name) \
    static __typeof__(&name) real; \
    if (!real) real = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

ssize_t read(int fd, void *to, size_t count) {
    REAL(read);
    return faulty(fd, READS, &count) ? -1 : real(fd, to, count);
}
ssize_t pread(int fd, void *to, size_t count, off_t at) {
    REAL(pread);
    return faulty(fd, READS, &count) ? -1 : real(fd, to, count, at);
}
ssize_t pread64(int fd, void *to, size_t count, off64_t at) {
    REAL(pread64);
    return faulty(fd, READS, &count) ? -1 : real(fd, to, count, at);
}
ssize_t write(int fd, const void *from, size_t count) {
    REAL(write);
    return faulty(fd, WRITES, &count) ? -1 : real(fd, from, count);
}
ssize_t pwrite(int fd, const void *from, size_t count, off_t at) {
    REAL(pwrite);
    return faulty(fd, WRITES, &count) ? -1 : real(fd, from, count, at);
}
ssize_t pwrite64(int fd, const void *from, size_t count, off64_t at) {
    REAL(pwrite64);
    return faulty(fd, WRITES, &count) ? -1 : real(fd, from, count, at);
}
ssize_t writev(int fd, const struct iovec *parts, int n) {
    REAL(writev);
    size_t count = 0;
    return faulty(fd, WRITES, &count) ? -1 : real(fd, parts, n);
}

/* The C library's own calls do not come by here: its streams are asked as a whole, and go on after EINTR and short calls. */
static int stream_fails(FILE *stream, int asked) {
    size_t count = 0;
    if ((kind != FAILS && kind != KILLED) || !faulty(fileno(stream), asked, &count)) return 0;
    stream->_flags |= 0x20; /* ferror() */
    return 1;
}
size_t fread(void *to, size_t size, size_t n, FILE *stream) {
    REAL(fread);
    return stream_fails(stream, READS) ? 0 : real(to, size, n, stream);
}
size_t fwrite(const void *from, size_t size, size_t n, FILE *stream) {
    REAL(fwrite);
    return stream_fails(stream, WRITES) ? 0 : real(from, size, n, stream);
}
