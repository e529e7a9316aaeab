/* What a program on a board has to live on: a serial line and a clock. board.c is the mps2-an386 (Cortex-M4F) of qemu,
   board_host.c this machine with stdin and stdout. main() returns the exit code. */
#ifndef FLAPPY_BOARD
#define FLAPPY_BOARD 1

#include <stdint.h>

/* Waits for n bytes. 1, or 0 when the input has ended, which a serial line never does. */
int board_read(void *to, unsigned n);
/* Returns when the last byte is on its way. */
void board_write(const void *from, unsigned n);
/* Microseconds of the board's clock; it starts again from 0 after 71 minutes. */
uint32_t board_us(void);

#endif
