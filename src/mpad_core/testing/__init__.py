"""What a part can prove about itself; shipped to plugin authors."""
