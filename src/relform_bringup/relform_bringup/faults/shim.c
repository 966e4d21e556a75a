/* Between a process and libc: a clock of the machine that jumps, and a disk on which each write takes long.
   Both are set in flight by the 16 bytes of the file that RELFORM_FAULTS names. Steady clocks do not jump. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#define SECOND_NS 1000000000LL
#define SLICE_NS 20000000LL /* how late a wait may notice that the clock has jumped */

struct faults {
    volatile long long jump_ns, write_ns;
};
static struct faults none;
static const struct faults *faults = &none;

__attribute__((constructor)) static void open_faults(void)
{
    const char *path = getenv("RELFORM_FAULTS");
    int file = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    if (file < 0)
        return;
    void *shared = mmap(NULL, sizeof(struct faults), PROT_READ, MAP_SHARED, file, 0);
    if (shared != MAP_FAILED)
        faults = shared;
    close(file);
}

#define REAL(name) ({ static __typeof__(&name) real; if (!real) real = dlsym(RTLD_NEXT, #name); real; })

static long long as_ns(const struct timespec *time)
{
    return time->tv_sec * SECOND_NS + time->tv_nsec;
}

static struct timespec from_ns(long long time_ns)
{
    return (struct timespec){.tv_sec = time_ns / SECOND_NS, .tv_nsec = time_ns % SECOND_NS};
}

int clock_gettime(clockid_t clock, struct timespec *time)
{
    int result = REAL(clock_gettime)(clock, time);
    if (result == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE))
        *time = from_ns(as_ns(time) + faults->jump_ns);
    return result;
}

int gettimeofday(struct timeval *time, void *zone)
{
    (void)zone;
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    *time = (struct timeval){.tv_sec = now.tv_sec, .tv_usec = now.tv_nsec / 1000};
    return 0;
}

time_t time(time_t *time)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (time)
        *time = now.tv_sec;
    return now.tv_sec;
}

/* A wait until a time of the clock that jumps: in slices, as the kernel would end it after a jump. */
int pthread_cond_timedwait(pthread_cond_t *condition, pthread_mutex_t *mutex, const struct timespec *until)
{
    static __typeof__(&pthread_cond_timedwait) real;
    if (!real)
        real = dlvsym(RTLD_NEXT, "pthread_cond_timedwait", "GLIBC_2.3.2");
    if (condition->__data.__wrefs & 2) /* this condition waits by the steady clock */
        return real(condition, mutex, until);
    for (;;) {
        struct timespec now;
        REAL(clock_gettime)(CLOCK_REALTIME, &now);
        long long now_ns = as_ns(&now), left_ns = as_ns(until) - now_ns - faults->jump_ns;
        struct timespec slice = from_ns(now_ns + (left_ns < SLICE_NS ? left_ns : SLICE_NS));
        int result = real(condition, mutex, &slice);
        if (result != ETIMEDOUT || left_ns <= SLICE_NS)
            return result;
    }
}

static void wait_for_disk(int file)
{
    struct stat status;
    long long write_ns = faults->write_ns;
    if (write_ns > 0 && fstat(file, &status) == 0 && S_ISREG(status.st_mode)) {
        struct timespec duration = from_ns(write_ns);
        nanosleep(&duration, NULL);
    }
}

ssize_t write(int file, const void *data, size_t size)
{
    wait_for_disk(file);
    return REAL(write)(file, data, size);
}

int fsync(int file)
{
    wait_for_disk(file);
    return REAL(fsync)(file);
}
