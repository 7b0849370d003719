/* Cortex-M: vectors at the start of the image, floating point switched on before anything else, then main. */
    .syntax unified
    .thumb

    .section .vectors, "a"
    .word __stack_top
    .word reset_handler + 1
    .rept 14
    .word fault_handler + 1
    .endr

    .text
    .thumb_func
    .global reset_handler
reset_handler:
    ldr r0, =0xE000ED88 /* CPACR: coprocessors 10 and 11, if there are any */
    ldr r1, [r0]
    ldr r2, =0x00F00000
    orrs r1, r2
    str r1, [r0]
    dsb
    isb
    bl main
    b board_exit

    .thumb_func
    .global fault_handler
fault_handler:
    movs r0, #99
    b board_exit
