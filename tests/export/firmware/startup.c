/* Vector table and start of a Cortex-M4F under QEMU's mps2-an386: the floating-point unit on, then newlib's start. */
#include <stdint.h>

extern uint32_t stack_top;
void _start(void);

void reset_handler(void) {
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20; /* CPACR: full access to the floating-point unit */
    __asm volatile("dsb\n isb");
    _start();
    for (;;) {
    }
}

static void fault_handler(void) {
    for (;;) {
    }
}

__attribute__((section(".vectors"), used)) static const void *const vectors[16] = {
    &stack_top, (const void *)reset_handler, (const void *)fault_handler, (const void *)fault_handler,
};
