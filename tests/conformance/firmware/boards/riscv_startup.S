/* RISC-V, machine mode: floating point on, faults to an exit, then main. */
    .section .vectors, "ax"
    .global reset_handler
reset_handler:
    la sp, __stack_top
    la t0, fault_handler
    csrw mtvec, t0
    li t0, 0x6000 /* mstatus.FS */
    csrs mstatus, t0
    csrwi fcsr, 0
    call main
    tail board_exit

    .balign 4
fault_handler:
    li a0, 99
    tail board_exit

    .global semihosting_call
    .balign 16
semihosting_call: /* the three instructions must be uncompressed and in one page */
    .option push
    .option norvc
    slli x0, x0, 0x1f
    ebreak
    srai x0, x0, 7
    .option pop
    ret
