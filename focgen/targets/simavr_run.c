/* Feeds a program that simavr emulates with samples, and takes its results; see avr.c.jinja.
 *
 *   simavr_run ELF MCU CELL EVENT IN OUT STATE SIZE PAINT LONGEST INPUTS RESULTS
 *
 * CELL: address of the inputs, IN bytes of them, OUT bytes of results behind; EVENT: that of the event's byte;
 * STATE, SIZE: the state; PAINT: where free memory begins; LONGEST: million cycles that an answer may take.
 * INPUTS holds IN bytes a sample. RESULTS gets, a sample, OUT bytes and 4 of cycles, then the state's bytes where
 * the sample's event has bit 3; at the end 4 bytes: how much of the stack was used.
 *
 * Ends with 3 where an answer takes longer, with 4 where the program crashes.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <sim_avr.h>
#include <sim_elf.h>
#include <sim_io.h>

#define GPIOR0 0x3e
#define GPIOR1 0x4a
#define PAINT 0xa5

static uint32_t cell, event, in_bytes, out_bytes, state, state_bytes, paint;
static uint64_t begin, cycles, asked, longest;
static FILE *inputs, *results;
static int finished;

static void put32(uint32_t value)
{
    const uint8_t bytes[4] = {(uint8_t)value, (uint8_t)(value >> 8), (uint8_t)(value >> 16), (uint8_t)(value >> 24)};

    fwrite(bytes, 1, 4, results);
}

static void exchange(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param)
{
    (void)param;
    avr->data[address] = value;
    if (value == 1) {
        asked = avr->cycle;
        if (fread(avr->data + cell, 1, in_bytes, inputs) != in_bytes) {
            finished = 1;
        }
    } else if (value == 2) {
        fwrite(avr->data + cell + in_bytes, 1, out_bytes, results);
        put32((uint32_t)cycles);
        if (avr->data[event] & 8u) {
            fwrite(avr->data + state, 1, state_bytes, results);
        }
    }
}

static void count(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param)
{
    (void)param;
    avr->data[address] = value;
    if (value == 1) {
        begin = avr->cycle;
    } else {
        cycles = avr->cycle - begin;
    }
}

int main(int argc, char **argv)
{
    elf_firmware_t firmware;
    uint32_t deepest;
    avr_t *avr;

    if (argc != 13) {
        return 2;
    }
    memset(&firmware, 0, sizeof firmware);
    if (elf_read_firmware(argv[1], &firmware) != 0 || (avr = avr_make_mcu_by_name(argv[2])) == 0) {
        return 2;
    }
    cell = (uint32_t)atol(argv[3]), event = (uint32_t)atol(argv[4]);
    in_bytes = (uint32_t)atol(argv[5]), out_bytes = (uint32_t)atol(argv[6]);
    state = (uint32_t)atol(argv[7]), state_bytes = (uint32_t)atol(argv[8]), paint = (uint32_t)atol(argv[9]);
    longest = (uint64_t)atol(argv[10]) * 1000000u;
    inputs = fopen(argv[11], "rb"), results = fopen(argv[12], "wb");
    if (inputs == 0 || results == 0) {
        return 2;
    }
    avr_init(avr);
    avr->log = LOG_NONE;
    firmware.frequency = 16000000;
    avr_load_firmware(avr, &firmware);
    avr_register_io_write(avr, GPIOR0, exchange, 0);
    avr_register_io_write(avr, GPIOR1, count, 0);
    memset(avr->data + paint, PAINT, avr->ramend + 1u - paint);
    while (!finished) {
        const int now = avr_run(avr);

        if (now == cpu_Done || now == cpu_Crashed) {
            return 4;
        }
        if (avr->cycle - asked > longest) {
            return 3;
        }
    }
    for (deepest = paint; deepest <= avr->ramend && avr->data[deepest] == PAINT; deepest++) {
    }
    put32(avr->ramend + 1u - deepest);
    return fclose(results) != 0;
}
