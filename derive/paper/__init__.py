"""The paper's equations (1)-(27), as printed and as derived."""
