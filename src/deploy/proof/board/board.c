/* Start, serial line, clock and end on the mps2-an386 of qemu: Cortex-M4F, CMSDK UART 0 on the line, MPS2 FPGA counter
   as the clock, semihosting for the exit code. Arm DAI 0386, DDI 0479 and DUI 0471. */
#include "board.h"

typedef volatile uint32_t Register;
typedef struct {
  Register data, state, control, interrupt, baud_divider;
} Uart;
typedef struct {
  Register counter, prescale;
} Clock;

#define UART ((Uart *)0x40004000U)
#define CLOCK ((Clock *)0x40028018U)
#define COPROCESSORS (*(Register *)0xE000ED88U)

enum { TRANSMIT_FULL = 1, RECEIVED = 2, TRANSMIT_AND_RECEIVE = 3, CLOCK_MHZ = 25, FAULT = 3 };

int main(void);
extern uint32_t board_stack_top[], board_data[], board_data_end[], board_data_load[], board_bss[], board_bss_end[];

__attribute__((noreturn)) static void leave(int code) {
  /* SYS_EXIT_EXTENDED: ADP_Stopped_ApplicationExit and the code */
  const uint32_t reason[2] = {0x20026U, (uint32_t)code};
  register uint32_t operation __asm__("r0") = 0x20U;
  register const uint32_t *parameter __asm__("r1") = reason;
  while (UART->state & TRANSMIT_FULL) {
  }
  __asm__ volatile("bkpt 0xab" : : "r"(operation), "r"(parameter) : "memory");
  for (;;) {
  }
}

static void fault(void) { leave(FAULT); }

void board_reset(void);
void board_reset(void) {
  uint32_t *from = board_data_load, *to;
  COPROCESSORS |= 0xF00000U; /* the floating-point unit */
  __asm__ volatile("dsb\n isb" : : : "memory");
  for (to = board_data; to < board_data_end;) *to++ = *from++;
  for (to = board_bss; to < board_bss_end;) *to++ = 0;
  UART->baud_divider = 16;
  UART->control = TRANSMIT_AND_RECEIVE;
  CLOCK->prescale = CLOCK_MHZ - 1;
  CLOCK->counter = 0;
  leave(main());
}

typedef void (*Handler)(void);
typedef struct {
  uint32_t *stack;
  Handler reset, faults[14];
} Vectors;
__attribute__((section(".vectors"), used)) static const Vectors vectors = {
    board_stack_top,
    board_reset,
    {fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault}};

int board_read(void *to, unsigned n) {
  uint8_t *byte = (uint8_t *)to;
  for (; n > 0; --n) {
    while (!(UART->state & RECEIVED)) {
    }
    *byte++ = (uint8_t)UART->data;
  }
  return 1;
}

void board_write(const void *from, unsigned n) {
  const uint8_t *byte = (const uint8_t *)from;
  for (; n > 0; --n) {
    while (UART->state & TRANSMIT_FULL) {
    }
    UART->data = *byte++;
  }
}

uint32_t board_us(void) { return CLOCK->counter; }
