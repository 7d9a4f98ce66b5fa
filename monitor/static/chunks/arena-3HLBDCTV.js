import{a}from"./chunk-ZCKSEBI2.js";import"./chunk-FPCBWDPQ.js";import"./chunk-OULW4S7M.js";import"./chunk-6DHFEWGX.js";export{a as Arena};
