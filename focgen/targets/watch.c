/* What an emulator is watched with: unicorn calls it for every instruction.
 *
 * In C because there are millions of them. Compiled for this computer, never part of a controller.
 */
#include <stdint.h>

/* How an instruction finds the address of its access: base + (index << shift) + offset. `mask` has the bits that
   must be 0, or is 0 for an instruction that is not looked at; `condition` as ARM encodes it, 14 for always. */
typedef struct {
    int32_t base, index; /* numbers of registers, 0: none */
    int32_t offset;
    uint8_t shift, mask, condition, negative;
} focgen_access;

typedef struct {
    uint64_t halfwords;   /* of code, from address 0 */
    uint32_t *runs;       /* by halfword: how often the instruction there ran */
    uint32_t *jumps;      /* and how often something else than the instruction behind it followed */
    const focgen_access *accesses;
    int (*register_of)(void *uc, int number, void *value);
    int32_t flags;        /* number of the register with N, Z, C and V */
    uint32_t checking;
    uint64_t last, next;  /* halfword of the latest instruction; address behind it, 0 ahead of the first */
    uint64_t strays;      /* instructions outside of the code */
    uint64_t unaligned;   /* how many accesses had bits that must be 0; the first: */
    uint64_t first, first_pc;
} focgen_watch;

void focgen_on_code(void *uc, uint64_t address, uint32_t size, void *user);

static uint32_t value_of(const focgen_watch *w, void *uc, int number)
{
    uint64_t value = 0;

    if (number != 0) {
        (void)w->register_of(uc, number, &value);
    }
    return (uint32_t)value;
}

/* Whether a condition holds, as ARM defines the sixteen of them. */
static int holds(unsigned condition, uint32_t flags)
{
    const unsigned n = flags >> 31 & 1u, z = flags >> 30 & 1u, c = flags >> 29 & 1u, v = flags >> 28 & 1u;
    unsigned is = 1;

    switch (condition >> 1) {
    case 0: is = z; break;
    case 1: is = c; break;
    case 2: is = n; break;
    case 3: is = v; break;
    case 4: is = c & (z ^ 1u); break;
    case 5: is = n == v; break;
    case 6: is = (n == v) & (z ^ 1u); break;
    default: return 1;
    }
    return is != (condition & 1u);
}

static void check(focgen_watch *w, void *uc, const focgen_access *a, uint64_t pc)
{
    const uint32_t index = value_of(w, uc, a->index) << a->shift;
    const uint32_t at = value_of(w, uc, a->base) + (a->negative ? 0u - index : index) + (uint32_t)a->offset;

    if ((at & a->mask) == 0u || !holds(a->condition, a->condition < 14 ? value_of(w, uc, w->flags) : 0u)) {
        return;
    }
    if (w->unaligned++ == 0u) {
        w->first = at;
        w->first_pc = pc;
    }
}

void focgen_on_code(void *uc, uint64_t address, uint32_t size, void *user)
{
    focgen_watch *w = user;
    const uint64_t at = address >> 1;

    if (w->next != 0 && address != w->next) {
        w->jumps[w->last]++;
    }
    if (at >= w->halfwords) {
        w->strays++;
        w->next = 0;
        return;
    }
    w->runs[at]++;
    w->last = at;
    w->next = address + size;
    if (w->checking && w->accesses[at].mask != 0u) {
        check(w, uc, &w->accesses[at], address);
    }
}
