"""The mathematics, and nothing else: sympy in, files out.

Read in this order, which is also the order of the paper and of the imports:

    ir                  quantities, records, named steps, functions
    quantities          every symbol, once: spelling, glyph, unit, domain, meaning
    model               the equations of motion                                     (1)-(5)
    laplace             transform them, eliminate, name the numerators              (6)-(15)
    partial_fractions   split the poles, in real arithmetic                         (11), (16)-(18)
    time_domain         the states over time                                        (18)-(21)
    modes               what each mass may do, and what ends it
    energy              the energy of the body and the ledger                       (22)-(24)
    control             the controller's quantities, the apex, variations           (25)-(27)
    sensitivity         how states, apex and AED change with their inputs
    equations           the register: as printed, as derived, verdict, reason
    program             the named steps, ordered into functions
    stability           Routh's conditions, those that a model leaves open
    structs             the structs of the C library's interface
    model_file          a model of further terms from a file
    languages           functions, limits and coefficients in the spelling of NumPy and C
    instantiate         engine and templates, written in `real`, as C of one precision
    render              templates and engine into generated/
"""
