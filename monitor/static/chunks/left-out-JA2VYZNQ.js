import"./chunk-6DHFEWGX.js";var l=null,t=null;export{t as default,l as diagram};
